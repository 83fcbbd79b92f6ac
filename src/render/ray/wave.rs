//! Rays of a tile, wave by wave: where they meet something, what light leaves there, what they send on.

use super::coat::{Alpha, Batch, Dressed};
use super::optics;
use super::sampler;
use super::stage::{Finish, Hit, Real, Spot, Stage, ToLamp};
use super::{RayCount, RaySettings};
use crate::render::shade::LampKind;
use glam::{DVec3, Vec3};

/// The least that light counts which has met glass.
const FAINT: f64 = 1e-4;

/// Rays of a tile that are on their way at once, at most: surfaces that give back more than they get stop here.
const MOST: usize = 1 << 18;

/// A ray that is on its way to a pixel, and what its light counts there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Which pixel of the tile.
    pub place: u32,
    /// How often it was mirrored or refracted.
    pub bounce: u32,
    pub origin: DVec3,
    pub direction: DVec3,
    /// The first `t` that counts.
    pub near: f64,
    pub weight: DVec3,
    /// Share of the pixel's alpha.
    pub cover: f64,
    /// The object that it leaves.
    pub left: u32,
    /// Where the rays of the next pixels start and go: differences of origins to the right and down, then of directions.
    pub spread: [Vec3; 4],
}

/// Working memory of one thread.
#[derive(Default)]
pub(super) struct Wave {
    pub paths: Vec<Path>,
    next: Vec<Path>,
    hits: Vec<(Hit, u32)>,
    reached: Vec<[DVec3; 8]>,
    sent: Vec<(usize, ToLamp)>,
    pub count: RayCount,
    /// Light and alpha, a pixel of the tile each.
    pub sums: Vec<[f64; 4]>,
}

/// What one wave needs to know of its tile.
#[derive(Clone, Copy)]
pub(super) struct Here<'a> {
    pub settings: &'a RaySettings,
    /// First pixel of the tile.
    pub corner: [usize; 2],
    /// Pixels a row of it.
    pub width: usize,
    /// Which sample of each pixel.
    pub index: u32,
}

impl Wave {
    /// Follow all paths to their ends. `first` are the hits of the paths as they stand, where they are known.
    pub fn run<R: Real>(
        &mut self,
        stage: &Stage<R>,
        here: Here,
        first: impl Fn(&Path) -> Option<Option<Hit>>,
    ) {
        self.count.primary += self.paths.len() as u64;
        let mut wave = 0;
        while !self.paths.is_empty() {
            self.meet(stage, |p| if wave == 0 { first(p) } else { None });
            let hits = std::mem::take(&mut self.hits);
            for run in hits.chunk_by(|a, b| a.0.object == b.0.object).flat_map(|run| run.chunks(8)) {
                self.shade(stage, here, run);
            }
            self.hits = hits;
            std::mem::swap(&mut self.paths, &mut self.next);
            self.next.clear();
            self.count.secondary += self.paths.len() as u64;
            wave += 1;
        }
    }

    /// Find what each path meets, object by object; what meets nothing ends in the background.
    fn meet<R: Real>(&mut self, stage: &Stage<R>, known: impl Fn(&Path) -> Option<Option<Hit>>) {
        self.hits.clear();
        for (i, path) in self.paths.iter().enumerate() {
            match known(path).unwrap_or_else(|| stage.nearest(path, f64::INFINITY, true)) {
                Some(hit) => self.hits.push((hit, i as u32)),
                None => {
                    let (light, alpha) = stage.beyond(path);
                    add(&mut self.sums[path.place as usize], path.weight * light, path.cover * alpha);
                }
            }
        }
        self.hits.sort_by_key(|(hit, i)| (hit.object, *i));
    }

    /// Light at up to eight hits of one object, and the rays that go on from there.
    fn shade<R: Real>(&mut self, stage: &Stage<R>, here: Here, run: &[(Hit, u32)]) {
        // Lanes that nothing hit repeat the first.
        let object = run[0].0.object;
        let finish = *stage.finish(object);
        let pick: [(Hit, u32); 8] = std::array::from_fn(|k| run[if k < run.len() { k } else { 0 }]);
        let paths = pick.map(|(_, i)| self.paths[i as usize]);
        let hits = pick.map(|(hit, _)| hit);
        let spots = std::array::from_fn(|k| stage.spot(&paths[k], &hits[k]));
        let batch =
            Batch { body: stage.bodies.get(object as usize), material: finish.material, paths, hits, spots };
        let (dressed, alpha) = stage.coat.dress(stage.isa, &batch);
        self.count.shaded += run.len() as u64;

        // How much of each lamp arrives?
        self.reached.clear();
        if here.settings.shadows && dressed.takes_light() {
            for lamp in 0..stage.lamps.len() {
                self.sent.clear();
                let rays = (0..run.len()).map(|k| (k, to_lamp(stage, here, &batch, &dressed, lamp, k)));
                self.sent.extend(rays.filter_map(|(k, ray)| Some((k, ray?))));
                self.count.shadow += self.sent.len() as u64;
                let rays: Vec<ToLamp> = self.sent.iter().map(|s| s.1).collect();
                let (shares, mut reached) = (stage.passing(&rays, object), [DVec3::ZERO; 8]);
                self.sent.iter().zip(shares).for_each(|((k, _), share)| reached[*k] = share);
                self.reached.push(reached);
            }
        }
        let colors = stage.coat.light(stage.isa, &dressed, &stage.lamps, &self.reached);

        for k in 0..run.len() {
            let (path, hit) = (&batch.paths[k], &batch.hits[k]);
            let alpha = if finish.alpha == Alpha::Blend && batch.body.is_none() {
                stage.coat.solid_alpha(finish.material)
            } else {
                alpha[k]
            };
            // The inside of glass has no light of its own.
            let own = if finish.is_glass() && hit.back { DVec3::ZERO } else { colors[k] };
            // What glass lets through shows what lies behind it, and be it nothing.
            let shown = if finish.is_glass() { 0.0 } else { alpha };
            add(&mut self.sums[path.place as usize], path.weight * own * alpha, path.cover * shown);
            let normal = match batch.body {
                Some(_) => dressed.normal(k),
                None => batch.faced(k),
            };
            self.send::<R>(here, path, hit, &batch.spots[k], normal, &finish, alpha);
        }
    }

    /// Rays that go on: through what blends, mirrored, refracted.
    fn send<R: Real>(
        &mut self,
        here: Here,
        path: &Path,
        hit: &Hit,
        spot: &Spot,
        normal: DVec3,
        finish: &Finish,
        alpha: f64,
    ) {
        // Each meeting with glass makes two rays of one; those that are too faint are left out whatever the settings say.
        let least = if finish.is_glass() { FAINT } else { 0.0 };
        let cutoff = here.settings.cutoff.max(least);
        if alpha < 1.0 {
            // The same ray, from the next number on: what is seen through a surface does not move.
            let near = next_up::<R>(hit.t);
            let (weight, cover) = (path.weight * (1.0 - alpha), path.cover * (1.0 - alpha));
            self.push(cutoff, Path { near, weight, cover, ..*path });
        }
        let ends = path.bounce >= here.settings.depth;
        if ends || !finish.is_glass() && finish.mirror.max_element() <= 0.0 {
            let rest = if finish.is_glass() { path.cover * alpha } else { 0.0 };
            return add(&mut self.sums[path.place as usize], DVec3::ZERO, rest);
        }
        let d = path.direction.normalize_or(DVec3::NEG_Z);
        let towards = |n: DVec3| if n.dot(d) > 0.0 { -n } else { n };
        let (n, face) = (towards(normal), towards(spot.face));
        let [x, y, dx, dy] = carried(path, hit.t, face);
        let on = |direction: DVec3, spread: [Vec3; 2], weight: DVec3, cover: f64| Path {
            bounce: path.bounce + 1,
            origin: spot.leave(direction),
            direction,
            near: 0.0,
            weight: path.weight * weight * alpha,
            cover,
            left: hit.object,
            spread: [x, y, spread[0], spread[1]],
            ..*path
        };
        // A mirror that is bent by normals must not throw light through itself.
        let level = optics::mirrored(d, n);
        let mirrored = if level.dot(face) > 0.0 { level } else { optics::mirrored(d, face) };
        let turned = [dx, dy].map(|v| optics::mirrored(v.as_dvec3(), face).as_vec3());
        if finish.mirror.max_element() > 0.0 {
            self.push(cutoff, on(mirrored, turned, finish.mirror, 0.0));
        }
        if finish.is_glass() {
            let bent = optics::refracted(d, n, if hit.back { finish.ior } else { 1.0 / finish.ior });
            let bent = bent.filter(|b| b.0.dot(face) < 0.0);
            let share = bent.map_or(1.0, |b| b.1);
            add(&mut self.sums[path.place as usize], DVec3::ZERO, path.cover * share * alpha);
            self.push(cutoff, on(mirrored, turned, DVec3::splat(share), 0.0));
            if let Some((t, share)) = bent {
                let cover = path.cover * (1.0 - share) * alpha;
                self.push(cutoff, on(t, [dx, dy], finish.transmission * (1.0 - share), cover));
            }
        }
    }

    /// Send a ray on if its light still counts.
    fn push(&mut self, cutoff: f64, path: Path) {
        if path.weight.max_element().max(path.cover) > cutoff && self.next.len() < MOST {
            self.next.push(path);
        }
    }
}

fn add(sum: &mut [f64; 4], light: DVec3, alpha: f64) {
    let [r, g, b] = light.to_array();
    for (s, x) in sum.iter_mut().zip([r, g, b, alpha]) {
        *s += x;
    }
}

/// The next number above, as `R` has it.
fn next_up<R: Real>(t: f64) -> f64 {
    let step = t.abs() * 2.0 * R::ROUNDOFF;
    let up = <R as crate::math::lanes::Real>::of(t + step).wide();
    if up > t { up } else { t.next_up() }
}

/// Differences of a path where it has met a plane: its neighbours have run to that plane.
fn carried(path: &Path, t: f64, face: DVec3) -> [Vec3; 4] {
    let [ox, oy, dx, dy] = path.spread.map(|v| v.as_dvec3());
    let d = path.direction;
    let rise = d.dot(face);
    let rise = if rise.abs() < 1e-6 * d.length() { 1e-6 * d.length().copysign(rise) } else { rise };
    let run = |o: DVec3, s: DVec3| {
        let m = o + s * t;
        (m - d * (m.dot(face) / rise)).as_vec3()
    };
    // Directions are unit from here on.
    let scale = 1.0 / d.length();
    let turn = |s: DVec3| ((s - d * (s.dot(d) * scale * scale)) * scale).as_vec3();
    [run(ox, dx), run(oy, dy), turn(dx), turn(dy)]
}

/// The ray from a hit to a lamp; none where the surface is turned away: it gets nothing, whatever lies between.
fn to_lamp<R: Real>(
    stage: &Stage<R>,
    here: Here,
    batch: &Batch,
    dressed: &Dressed<R>,
    lamp: usize,
    k: usize,
) -> Option<ToLamp> {
    let (path, hit, spot) = (&batch.paths[k], &batch.hits[k], &batch.spots[k]);
    let light = &stage.lamps[lamp];
    // Where in the lamp: its middle, unless it has a size and there is more than one sample.
    let radius = light.radius.wide();
    let [a, b] = if radius > 0.0 && here.settings.samples > 1 {
        let place = path.place as usize;
        let pixel = [here.corner[0] + place % here.width, here.corner[1] + place / here.width];
        let dimension = 1 + lamp as u32 + path.bounce * stage.lamps.len() as u32;
        disc(sampler::sample(here.settings.seed, pixel.map(|x| x as u32), here.index, dimension))
    } else {
        [0.0; 2]
    };
    let aside = |axis: DVec3| {
        let x = axis.any_orthonormal_vector();
        (x * a + axis.cross(x) * b) * radius
    };
    let (towards, far) = match light.kind {
        LampKind::Directional { towards } => (towards.wide(), f64::INFINITY),
        LampKind::Point { position, .. } | LampKind::Spot { position, .. } => {
            (position.wide() - spot.position, 1.0)
        }
    };
    let normal = dressed.normal(k);
    if stage.coat.gated() && normal.dot(towards) <= 0.0 {
        return None;
    }
    let towards = towards + aside(towards.normalize_or(DVec3::Y));
    let origin = match batch.body.and_then(|b| b.lift(hit.triangle, spot, normal)) {
        Some(lift) => spot.leave(normal) + lift,
        None => spot.leave(towards),
    };
    let direction = if far < f64::INFINITY { towards + (spot.position - origin) } else { towards };
    Some(ToLamp { origin, direction, far })
}

/// From the unit square onto the unit disc, areas kept (Shirley and Chiu 1997).
fn disc([x, y]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (2.0 * x - 1.0, 2.0 * y - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0; 2];
    }
    let quarter = std::f64::consts::FRAC_PI_4;
    let (r, angle) = if x.abs() > y.abs() { (x, quarter * (y / x)) } else { (y, quarter * (2.0 - x / y)) };
    [r * angle.cos(), r * angle.sin()]
}
