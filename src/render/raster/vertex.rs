//! Vertices to the picture plane, eight at a time.

use super::frame::{Frame, Projector};
use crate::math::simd::{self, F8, I8, Isa, Kernel, V8};
use glam::Vec3;

/// Fixed-point units a pixel.
pub(super) const UNITS: f32 = 256.0;

/// Coordinates relative to the picture's centre stay within ±2²² units, where f32 still holds every integer.
pub(super) const GUARD: f32 = 4_194_304.0;

/// The x of a vertex that has no place within the guard band: triangles that use it are clipped.
pub(super) const OUTSIDE: i32 = i32::MIN;

/// Where the vertices of all draws are: x and y in 1/256 pixels from the top left corner, and depth.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub xy: Vec<[i32; 2]>,
    pub z: Vec<f32>,
}

impl Vertices {
    /// Carry the vertices of all draws.
    pub fn fill(&mut self, isa: Isa, frame: &Frame, threads: usize) {
        let n = frame.vertex_count;
        self.xy.resize(n.max(self.xy.len()), [0; 2]);
        self.z.resize(n.max(self.z.len()), 0.0);

        // Cut each draw's list into one share a thread.
        let (mut xy, mut z) = (&mut self.xy[..n], &mut self.z[..n]);
        let mut tasks = vec![];
        for draw in &frame.draws {
            let share = draw.object.positions.len().div_ceil(threads).next_multiple_of(8).max(4096);
            for positions in draw.object.positions.chunks(share) {
                let (xy_task, xy_rest) = xy.split_at_mut(positions.len());
                let (z_task, z_rest) = z.split_at_mut(positions.len());
                (xy, z) = (xy_rest, z_rest);
                tasks.push(Transform { frame, positions, xy: xy_task, z: z_task });
            }
        }
        let threads = threads.min(tasks.len());
        if threads <= 1 {
            return tasks.into_iter().for_each(|t| simd::run(isa, t));
        }
        let queue = std::sync::Mutex::new(tasks.into_iter());
        super::each((0..threads).collect(), |_| {
            while let Some(t) = { queue.lock().expect("no worker panics").next() } {
                simd::run(isa, t);
            }
        });
    }
}

struct Transform<'a> {
    frame: &'a Frame<'a>,
    positions: &'a [Vec3],
    xy: &'a mut [[i32; 2]],
    z: &'a mut [f32],
}

impl Kernel for Transform<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let whole = self.positions.len() / 8 * 8;
        for i in (0..whole).step_by(8) {
            let p: &[Vec3; 8] = self.positions[i..i + 8].try_into().expect("eight");
            let (x, y, z) = place(self.frame, V8::gather(*p));
            let out: &mut [[i32; 2]; 8] = (&mut self.xy[i..i + 8]).try_into().expect("eight");
            for k in 0..8 {
                out[k] = [x.0[k], y.0[k]];
            }
            z.store(&mut self.z[i..i + 8]);
        }
        let rest = &self.positions[whole..];
        let mut p = [Vec3::ZERO; 8];
        p[..rest.len()].copy_from_slice(rest);
        let (x, y, z) = place(self.frame, V8::gather(p));
        for k in 0..rest.len() {
            self.xy[whole + k] = [x.0[k], y.0[k]];
            self.z[whole + k] = z.0[k];
        }
    }
}

/// Fixed-point x and y, and depth, of eight points.
#[inline(always)]
fn place(frame: &Frame, p: V8) -> (I8, I8, F8) {
    let m = &frame.project;
    let (z, w) = (Projector::row8(m.z, p), Projector::row8(m.w, p));
    let scale = F8::ONE / w;
    let units = scale * UNITS;
    let (x, y) = (Projector::row8(m.x, p) * units, Projector::row8(m.y, p) * units);

    // Behind the near plane, beyond the guard band or not a number: x says so.
    let limit = F8::splat(GUARD);
    let inside = limit.ge(x) & limit.ge(-x) & limit.ge(y) & limit.ge(-y);
    let good = inside & w.ge(z) & w.gt(F8::ZERO);
    let fixed_x = x.round() + I8::splat(frame.width * 128);
    let fixed_y = y.round() + I8::splat(frame.height * 128);
    (good.select_int(fixed_x, I8::splat(OUTSIDE)), fixed_y, z * scale)
}
