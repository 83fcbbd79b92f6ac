//! The two inner loops, with plain arrays and with AVX2: a ray against eight boxes, and against four triangles.
//!
//! The arrays leave too much to the compiler here: it neither keeps eight lanes in one register across the ordering of children
//! nor moves lanes by index, and a ray spends all its time in these few lines. Boxes only have to be conservative, so theirs are
//! the one place with fused multiply-adds; triangles give the same bits.

use super::ray::Slab;
use super::tree::Node;
use super::triangle::{EMPTY, Pack, Shear};
use crate::math::simd::Isa;

/// Nodes above one another at most; builders halve what is left before they run out.
pub(super) const DEPTH: usize = 16;

/// What a walk has put aside: seven siblings a level, and room to write eight at once.
pub struct Stack {
    pub t: [f32; 128],
    pub at: [u32; 128],
    pub top: usize,
}

const _: () = assert!(7 * DEPTH + 1 + 8 <= 128);

/// A way to do eight things at a time.
pub trait Lanes: Copy {
    /// A ray, ready.
    type Ray;
    /// Make it ready.
    fn ray(slab: &Slab) -> Self::Ray;
    /// The child that a ray enters first, if it does so before `t_max`; the others that it enters go on the stack, the farther the
    /// deeper.
    fn enter(node: &Node, ray: &Self::Ray, t_max: f32, stack: &mut Stack) -> Option<u32>;
    /// Which of four triangles may be hit, a bit each: all but those that the signs of rounded edge functions rule out.
    fn candidates(pack: &Pack, ray: &Shear<f32>) -> u32;
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
        Self(able && isa == Isa::Best)
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
            let (t, at) = (enter.0[lane], node.children[lane]);
            let mut i = stack.top;
            while i > first && stack.t[i - 1] < t {
                (stack.t[i], stack.at[i]) = (stack.t[i - 1], stack.at[i - 1]);
                i -= 1;
            }
            (stack.t[i], stack.at[i]) = (t, at);
            stack.top += 1;
        }
        if stack.top == first {
            return None;
        }
        stack.top -= 1;
        Some(stack.at[stack.top])
    }

    #[inline(always)]
    fn candidates(pack: &Pack, ray: &Shear<f32>) -> u32 {
        pack.candidates(ray)
    }
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod avx2 {
    use super::*;
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
        enter: [usize; 3],
        leave: [usize; 3],
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

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn all(v: [f32; 3]) -> [__m256; 3] {
        [_mm256_set1_ps(v[0]), _mm256_set1_ps(v[1]), _mm256_set1_ps(v[2])]
    }

    /// Where a ray crosses one plane an axis of each box.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn crossed(node: &Node, rows: [usize; 3], slope: [__m256; 3], at: [__m256; 3]) -> [__m256; 3] {
        // Rows are 0…5.
        let plane = |k: usize| unsafe { _mm256_load_ps(node.planes[rows[k]].0.as_ptr()) };
        [
            _mm256_fmsub_ps(plane(0), slope[0], at[0]),
            _mm256_fmsub_ps(plane(1), slope[1], at[1]),
            _mm256_fmsub_ps(plane(2), slope[2], at[2]),
        ]
    }

    /// One corner of four triangles, sheared.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn corner(pack: &Pack, c: usize, ray: &Shear<f32>) -> [__m128; 2] {
        let along = |i: usize| {
            let k = ray.axes[i];
            let p = unsafe { _mm_load_ps(pack.corners[c][k].as_ptr()) };
            _mm_sub_ps(p, _mm_set1_ps(ray.origin[k]))
        };
        let z = along(2);
        let x = _mm_sub_ps(along(0), _mm_mul_ps(_mm_set1_ps(ray.slope[0]), z));
        let y = _mm_sub_ps(along(1), _mm_mul_ps(_mm_set1_ps(ray.slope[1]), z));
        [x, y]
    }

    /// Where an edge function is surely positive, and surely negative.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn edge(p: [__m128; 2], q: [__m128; 2]) -> (__m128, __m128) {
        let (l, r) = (_mm_mul_ps(p[0], q[1]), _mm_mul_ps(p[1], q[0]));
        (_mm_cmpgt_ps(l, r), _mm_cmplt_ps(l, r))
    }

    // Only reached through `run`, so the instructions exist; all loads and stores are of whole fields.
    impl Lanes for Avx2 {
        type Ray = Ray;

        #[inline(always)]
        fn ray(s: &Slab) -> Ray {
            let leave = s.enter.map(|row| (row + 3) % 6);
            let Slab { enter, octant, .. } = *s;
            unsafe {
                Ray {
                    slope: all(s.slope),
                    near: all(s.near),
                    far: all(s.far),
                    t_min: _mm256_set1_ps(s.t_min),
                    enter,
                    leave,
                    octant,
                }
            }
        }

        #[inline(always)]
        fn enter(node: &Node, ray: &Ray, t_max: f32, stack: &mut Stack) -> Option<u32> {
            unsafe {
                let (near, far) = (ray.near, ray.far);
                let [x0, y0, z0] = crossed(node, ray.enter, ray.slope, near);
                let [x1, y1, z1] = crossed(node, ray.leave, ray.slope, far);
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
                _mm256_storeu_ps(t.as_mut_ptr(), _mm256_permutevar8x32_ps(enter, members));
                let children = _mm256_permutevar8x32_epi32(children, members);
                _mm256_storeu_si256(at.as_mut_ptr().cast(), children);
                stack.top = top + set.count_ones() as usize;
                Some(first)
            }
        }

        #[inline(always)]
        fn candidates(pack: &Pack, ray: &Shear<f32>) -> u32 {
            unsafe {
                let (a, b, c) = (corner(pack, 0, ray), corner(pack, 1, ray), corner(pack, 2, ray));
                let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
                let above = _mm_or_ps(_mm_or_ps(u.0, v.0), w.0);
                let below = _mm_or_ps(_mm_or_ps(u.1, v.1), w.1);
                let ids = _mm_load_ps(pack.ids.as_ptr().cast());
                const { assert!(EMPTY >> 31 == 1) };
                let out = _mm_or_ps(_mm_and_ps(above, below), ids);
                !_mm_movemask_ps(out) as u32 & 15
            }
        }
    }
}
