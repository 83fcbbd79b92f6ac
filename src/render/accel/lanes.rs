//! The two inner loops, with plain arrays and with AVX2: a ray against eight boxes, and against four triangles.
//!
//! The arrays leave too much to the compiler here: it neither keeps eight lanes in one register across the ordering of children
//! nor moves lanes by index, and a ray spends all its time in these few lines. Boxes only have to be conservative, so theirs are
//! the one place with fused multiply-adds; triangles give the same bits.

use super::ray::Slab;
use super::tree::Node;
use super::triangle::{Meetings, Pack, Shear};
use crate::math::simd::Isa;
use std::mem::MaybeUninit;

/// Nodes above one another at most; builders halve what is left before they run out.
pub(super) const DEPTH: usize = 54;

const STACK: usize = 7 * DEPTH + 1 + 8;

/// What a walk has put aside: seven siblings a level, and room to write eight at once.
pub struct Stack {
    t: [MaybeUninit<f32>; STACK],
    at: [MaybeUninit<u32>; STACK],
    top: usize,
}

// Filling it with zeros would take a tenth of the time of a ray. Below `top` everything has been written.
#[allow(unsafe_code)]
impl Stack {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            t: [const { MaybeUninit::uninit() }; STACK],
            at: [const { MaybeUninit::uninit() }; STACK],
            top: 0,
        }
    }

    #[inline(always)]
    fn get(&self, i: usize) -> (f32, u32) {
        assert!(i < self.top);
        unsafe { (self.t[i].assume_init(), self.at[i].assume_init()) }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, (t, at): (f32, u32)) {
        assert!(i < self.top);
        self.t[i].write(t);
        self.at[i].write(at);
    }

    #[inline(always)]
    fn push(&mut self, item: (f32, u32)) {
        self.t[self.top].write(item.0);
        self.at[self.top].write(item.1);
        self.top += 1;
    }

    /// What was put aside last.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<(f32, u32)> {
        if self.top == 0 {
            return None;
        }
        let item = self.get(self.top - 1);
        self.top -= 1;
        Some(item)
    }
}

/// A way to do eight things at a time.
pub trait Lanes: Copy {
    /// A ray, ready.
    type Ray;
    /// Make it ready.
    fn ray(slab: &Slab) -> Self::Ray;
    /// The child that a ray enters first, if it does so before `t_max`; the others that it enters go on the stack, the farther the
    /// deeper.
    fn enter(node: &Node, ray: &Self::Ray, t_max: f32, stack: &mut Stack) -> Option<u32>;
    /// Which of four triangles are hit in the ray's range, a bit each.
    fn meet(pack: &Pack, ray: &Shear<f32>, out: &mut Meetings<f32>) -> u32;
}

/// Work for one ray.
pub(super) trait Work {
    /// What it gives.
    type Output;
    /// Do it, `#[inline(always)]`.
    fn run<S: Lanes>(self) -> Self::Output;
}

/// Which lanes there are; whoever has one of these has asked the machine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Machine(bool);

impl Machine {
    pub fn new(isa: Isa) -> Self {
        #[cfg(target_arch = "x86_64")]
        let able = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        #[cfg(not(target_arch = "x86_64"))]
        let able = false;
        Self(able && isa != Isa::Portable)
    }

    #[inline(always)]
    pub fn run<W: Work>(self, work: W) -> W::Output {
        #[cfg(target_arch = "x86_64")]
        if self.0 {
            // `new` is the only place that sets this, and has asked for both.
            #[allow(unsafe_code)]
            return unsafe { avx2::run(work) };
        }
        work.run::<Portable>()
    }
}

/// Plain arrays.
#[derive(Clone, Copy)]
pub(super) struct Portable;

impl Lanes for Portable {
    type Ray = Slab;
    #[inline(always)]
    fn ray(slab: &Slab) -> Slab {
        *slab
    }

    #[inline(always)]
    fn enter(node: &Node, ray: &Slab, t_max: f32, stack: &mut Stack) -> Option<u32> {
        let (mut bits, enter) = node.entered(ray, t_max);
        let first = stack.top;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let item = (enter.0[lane], node.children[lane]);
            stack.push(item);
            let mut i = stack.top - 1;
            while i > first && stack.get(i - 1).0 < item.0 {
                stack.set(i, stack.get(i - 1));
                i -= 1;
            }
            stack.set(i, item);
        }
        if stack.top > first { stack.pop().map(|(_, at)| at) } else { None }
    }

    #[inline(always)]
    fn meet(pack: &Pack, ray: &Shear<f32>, out: &mut Meetings<f32>) -> u32 {
        pack.meet(ray, out)
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
    use super::super::triangle::EMPTY;
    use super::*;
    use glam::Vec3A;
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx2,fma")]
    pub fn run<W: Work>(work: W) -> W::Output {
        work.run::<Avx2>()
    }

    #[derive(Clone, Copy)]
    struct Avx2;

    struct Ray {
        slope: [__m256; 3],
        near: [__m256; 3],
        far: [__m256; 3],
        t_min: __m256,
        /// Rows of planes where it enters, and where it leaves.
        rows: [[usize; 3]; 2],
        octant: usize,
    }

    /// The members of each set of lanes, last to first.
    static MEMBERS: [[u8; 8]; 256] = {
        let mut all = [[0; 8]; 256];
        let mut set = 0;
        while set < 256 {
            let (mut lane, mut n) = (8, 0);
            while lane > 0 {
                lane -= 1;
                if set >> lane & 1 == 1 {
                    all[set][n] = lane as u8;
                    n += 1;
                }
            }
            set += 1;
        }
        all
    };

    /// For each octant, which planes are near and which are far.
    static ROWS: [[[usize; 3]; 2]; 8] = {
        let mut rows = [[[0, 1, 2], [3, 4, 5]]; 8];
        let mut octant = 0;
        while octant < 8 {
            let mut k = 0;
            while k < 3 {
                if octant >> k & 1 == 1 {
                    (rows[octant][0][k], rows[octant][1][k]) = (k + 3, k);
                }
                k += 1;
            }
            octant += 1;
        }
        rows
    };

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn all(v: Vec3A) -> [__m256; 3] {
        [_mm256_set1_ps(v.x), _mm256_set1_ps(v.y), _mm256_set1_ps(v.z)]
    }

    /// Where a ray crosses one plane an axis of each box.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn crossed(node: &Node, rows: &[usize; 3], slope: [__m256; 3], at: [__m256; 3]) -> [__m256; 3] {
        // Rows come from the table: 0…5.
        let plane = |k: usize| unsafe { _mm256_load_ps(node.planes.get_unchecked(rows[k]).0.as_ptr()) };
        [
            _mm256_fmsub_ps(plane(0), slope[0], at[0]),
            _mm256_fmsub_ps(plane(1), slope[1], at[1]),
            _mm256_fmsub_ps(plane(2), slope[2], at[2]),
        ]
    }

    /// One corner of four triangles, sheared.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn corner(pack: &Pack, c: usize, ray: &Shear<f32>) -> [__m128; 3] {
        let along = |i: usize| {
            let k = ray.axes[i];
            let p = unsafe { _mm_load_ps(pack.corners[c][k].as_ptr()) };
            _mm_sub_ps(p, _mm_set1_ps(ray.origin[k]))
        };
        let z = along(2);
        let x = _mm_sub_ps(along(0), _mm_mul_ps(_mm_set1_ps(ray.slope[0]), z));
        let y = _mm_sub_ps(along(1), _mm_mul_ps(_mm_set1_ps(ray.slope[1]), z));
        [x, y, z]
    }

    /// Where an edge function is surely positive, and surely negative.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn edge(p: [__m128; 3], q: [__m128; 3]) -> (__m128, __m128) {
        let (l, r) = (_mm_mul_ps(p[0], q[1]), _mm_mul_ps(p[1], q[0]));
        (_mm_cmpgt_ps(l, r), _mm_cmplt_ps(l, r))
    }

    // Only reached through `run`, so the instructions exist; all loads and stores are of whole fields.
    impl Lanes for Avx2 {
        type Ray = Ray;

        #[inline(always)]
        fn ray(s: &Slab) -> Ray {
            let octant = s.octant & 7;
            let (slope, near, far) = unsafe { (all(s.slope), all(s.near), all(s.far)) };
            Ray { slope, near, far, t_min: unsafe { _mm256_set1_ps(s.t_min) }, rows: ROWS[octant], octant }
        }

        #[inline(always)]
        fn enter(node: &Node, ray: &Ray, t_max: f32, stack: &mut Stack) -> Option<u32> {
            unsafe {
                let (near, far) = (ray.near, ray.far);
                let [x0, y0, z0] = crossed(node, &ray.rows[0], ray.slope, near);
                let [x1, y1, z1] = crossed(node, &ray.rows[1], ray.slope, far);
                let enter = _mm256_max_ps(_mm256_max_ps(x0, y0), _mm256_max_ps(z0, ray.t_min));
                let leave = _mm256_min_ps(_mm256_min_ps(x1, y1), _mm256_min_ps(z1, _mm256_set1_ps(t_max)));
                let met = _mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave);

                // In the order of the octant, the first goes on at once.
                let shifts = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
                let packed = node.order[ray.octant];
                let order = _mm256_srlv_epi32(_mm256_set1_epi32(packed as i32), shifts);
                let set = _mm256_movemask_ps(_mm256_permutevar8x32_ps(met, order)) as u32;
                if set == 0 {
                    return None;
                }
                let first = node.children[(packed >> (4 * set.trailing_zeros()) & 7) as usize];
                let set = set & (set - 1);
                if set == 0 {
                    return Some(first);
                }

                // The others without gaps.
                let top = stack.top;
                let (t, at) = (&mut stack.t[top..top + 8], &mut stack.at[top..top + 8]);
                let members = _mm_loadl_epi64(MEMBERS[set as usize & 255].as_ptr().cast());
                let members = _mm256_permutevar8x32_epi32(order, _mm256_cvtepu8_epi32(members));
                let children = _mm256_load_si256(node.children.as_ptr().cast());
                _mm256_storeu_ps(t.as_mut_ptr().cast(), _mm256_permutevar8x32_ps(enter, members));
                let children = _mm256_permutevar8x32_epi32(children, members);
                _mm256_storeu_si256(at.as_mut_ptr().cast(), children);
                stack.top = top + set.count_ones() as usize;
                Some(first)
            }
        }

        #[inline(always)]
        fn meet(pack: &Pack, ray: &Shear<f32>, out: &mut Meetings<f32>) -> u32 {
            unsafe {
                let (a, b, c) = (corner(pack, 0, ray), corner(pack, 1, ray), corner(pack, 2, ray));

                // Surely missed?
                let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
                let above = _mm_or_ps(_mm_or_ps(u.0, v.0), w.0);
                let below = _mm_or_ps(_mm_or_ps(u.1, v.1), w.1);
                let ids = _mm_load_ps(pack.ids.as_ptr().cast());
                const { assert!(EMPTY >> 31 == 1) };
                let missed = _mm_movemask_ps(_mm_or_ps(_mm_and_ps(above, below), ids));
                if missed == 15 {
                    return 0;
                }

                // The exact edge functions.
                let u = minor(c[0], b[1], c[1], b[0]);
                let v = minor(a[0], c[1], a[1], c[0]);
                let w = minor(b[0], a[1], b[1], a[0]);
                let zero = _mm256_setzero_pd();
                let least = _mm256_min_pd(_mm256_min_pd(u, v), w);
                let most = _mm256_max_pd(_mm256_max_pd(u, v), w);
                let (below, above) =
                    (_mm256_cmp_pd::<_CMP_LT_OQ>(least, zero), _mm256_cmp_pd::<_CMP_GT_OQ>(most, zero));
                let missed = missed | _mm256_movemask_pd(_mm256_and_pd(below, above));

                // Where along the ray.
                let det = _mm256_add_pd(_mm256_add_pd(u, v), w);
                let [za, zb, zc] = [_mm256_cvtps_pd(a[2]), _mm256_cvtps_pd(b[2]), _mm256_cvtps_pd(c[2])];
                let sum = _mm256_add_pd(_mm256_mul_pd(u, za), _mm256_mul_pd(v, zb));
                let sum = _mm256_add_pd(sum, _mm256_mul_pd(w, zc));
                let t = _mm256_cvtpd_ps(_mm256_div_pd(sum, _mm256_mul_pd(det, _mm256_set1_pd(ray.depth))));
                let late = _mm_cmpge_ps(t, _mm_set1_ps(ray.t_min));
                let range = _mm_movemask_ps(_mm_and_ps(late, _mm_cmple_ps(t, _mm_set1_ps(ray.t_max))));
                let some = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_NEQ_OQ>(det, zero));
                _mm256_store_pd(out.v.as_mut_ptr(), v);
                _mm256_store_pd(out.w.as_mut_ptr(), w);
                _mm256_store_pd(out.det.as_mut_ptr(), det);
                _mm_store_ps(out.t.as_mut_ptr(), t);
                (!missed & range & some) as u32
            }
        }
    }

    /// Products of two f32 are exact in f64, so that fused operations on them give the bits of the portable form.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn minor(a: __m128, b: __m128, c: __m128, d: __m128) -> __m256d {
        let cd = _mm256_mul_pd(_mm256_cvtps_pd(c), _mm256_cvtps_pd(d));
        _mm256_fmsub_pd(_mm256_cvtps_pd(a), _mm256_cvtps_pd(b), cd)
    }
}
