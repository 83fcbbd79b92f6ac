//! What is asked of a ray: its first hit, or whether there is one.

use super::lanes::Lanes;
use super::ray::{Hit, Ray, Real, above};
use super::tree::Visitor;
use super::triangle::{Meetings, Pack, Shear};

/// A question that hits answer.
pub(super) trait Search<R> {
    /// One more hit.
    fn found(&mut self, hit: Hit<R>);
    /// The last `t` that is still of interest, given what it was: −∞ when the answer is known.
    fn limit(&self, t_max: f32) -> f32;
}

/// The first hit that is accepted.
pub(super) struct Nearest<R, F> {
    accept: F,
    pub best: Option<Hit<R>>,
}

impl<R: Real, F: Fn(&Hit<R>) -> bool> Nearest<R, F> {
    #[inline(always)]
    pub fn new(accept: F) -> Self {
        Self { accept, best: None }
    }
}

impl<R: Real, F: Fn(&Hit<R>) -> bool> Search<R> for Nearest<R, F> {
    #[inline(always)]
    fn found(&mut self, hit: Hit<R>) {
        if self.best.is_none_or(|b| hit.before(&b)) && (self.accept)(&hit) {
            self.best = Some(hit);
        }
    }

    #[inline(always)]
    fn limit(&self, t_max: f32) -> f32 {
        self.best.map_or(t_max, |b| above(b.t))
    }
}

/// Any hit that is accepted.
pub(super) struct Any<F> {
    accept: F,
    pub found: bool,
}

impl<F> Any<F> {
    #[inline(always)]
    pub fn new(accept: F) -> Self {
        Self { accept, found: false }
    }
}

impl<R: Real, F: Fn(&Hit<R>) -> bool> Search<R> for Any<F> {
    #[inline(always)]
    fn found(&mut self, hit: Hit<R>) {
        self.found = self.found || (self.accept)(&hit);
    }

    #[inline(always)]
    fn limit(&self, t_max: f32) -> f32 {
        if self.found { f32::NEG_INFINITY } else { t_max }
    }
}

/// The leaves of one surface.
pub(super) struct Packs<'a, R, Q> {
    pub packs: &'a [Pack],
    pub ray: &'a Ray<R>,
    /// Made ready for the first leaf.
    pub shear: Option<Shear<R>>,
    pub object: u32,
    pub search: &'a mut Q,
}

impl<R: Real, Q: Search<R>> Visitor for Packs<'_, R, Q> {
    #[inline(always)]
    fn leaf<S: Lanes>(&mut self, leaf: u32, t_max: f32) -> f32 {
        let pack = &self.packs[leaf as usize];
        let mut all = Meetings::new();
        let mut bits = R::meet::<S>(pack, self.shear.get_or_insert_with(|| Shear::new(self.ray)), &mut all);
        if bits == 0 {
            return t_max;
        }
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 3;
            bits &= bits - 1;
            self.search.found(all.hit(lane, self.object, pack.ids[lane]));
        }
        self.search.limit(t_max)
    }
}
