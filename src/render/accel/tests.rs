use super::*;
use crate::test_rng::Rng;

/// Triangles anywhere, large and small.
fn soup(rng: &mut Rng, n: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for _ in 0..n {
        let (centre, size) = (rng.point(1.0), 10f32.powf(rng.span(-3.0, 0.0)));
        positions.extend([0; 3].map(|_| centre + rng.point(size)));
    }
    let triangles = (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    (positions, triangles)
}

fn ray<R: Real>(rng: &mut Rng) -> Ray<R> {
    let three = |v: Vec3| v.to_array().map(R::from);
    let origin = rng.point(2.0);
    let (origin, direction) = (three(origin), three(rng.point(1.0) - origin));
    Ray { origin, direction, t_min: R::from(0.0), t_max: R::INFINITY }
}

fn agree<R: Real>(kinds: &[Accel], rays: usize) {
    let mut rng = Rng::new(7);
    let mut hits = 0;
    for _ in 0..rays {
        let mut r = ray::<R>(&mut rng);
        if rng.below(3) == 0 {
            r.t_max = R::from(rng.span(0.0, 2.0));
        }
        let found: Vec<_> = kinds.iter().map(|k| k.nearest(&r, |_| true)).collect();
        found.iter().for_each(|f| assert_eq!(*f, found[0], "{r:?}"));
        kinds.iter().for_each(|k| assert_eq!(k.blocked(&r, |_| true), found[0].is_some(), "{r:?}"));
        hits += found[0].is_some() as usize;
    }
    assert!(hits > rays / 4 && hits < rays, "{hits} of {rays}");
}

#[test]
fn every_kind_gives_the_same_hits() {
    let (positions, triangles) = soup(&mut Rng::new(1), 700);
    let kinds = [Kind::Tree, Kind::Brute].map(|k| Accel::new(k, &positions, &triangles, 1));
    agree::<f32>(&kinds, 3000);
    agree::<f64>(&kinds, 1000);
}

/// A bumpy sphere without a gap, of about `n` triangles.
fn closed(n: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let v = (n as f32 / 4.0).sqrt().round() as u32;
    let u = 2 * v;
    let at = |i: u32, j: u32| match j {
        0 => 0,
        j if j == v => 1,
        j => 2 + (j - 1) * u + i % u,
    };
    let mut positions = vec![Vec3::Y, Vec3::NEG_Y];
    let turn = std::f32::consts::PI / v as f32;
    for (j, i) in (1..v).flat_map(|j| (0..u).map(move |i| (j as f32, i as f32))) {
        let ((s, c), (sp, cp)) = ((j * turn).sin_cos(), (i * turn).sin_cos());
        let d = Vec3::new(s * cp, c, s * sp);
        positions.push(d * (1.0 + 0.12 * (7.0 * d.x).sin() * (9.0 * d.y).sin()));
    }
    let quads = (0..v).flat_map(|j| (0..u).map(move |i| (i, j)));
    let both = quads.flat_map(|(i, j)| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
        [[a, b, c], [b, d, c]]
    });
    (positions, both.filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect())
}

/// Rays from inside a closed surface: anywhere, at its corners, at its edges. Gives how many got out.
fn escapes<R: Real>(rays: usize) -> usize {
    let (positions, triangles) = closed(2000);
    let accel = Accel::new(Kind::Tree, &positions, &triangles, 1);
    let mut rng = Rng::new(11);
    let three = |v: Vec3| v.to_array().map(R::from);
    (0..rays)
        .filter(|i| {
            let origin = rng.point(0.4);
            let [a, b, _] = triangles[rng.below(triangles.len())].map(|c| positions[c as usize]);
            let aim = [rng.point(1.0), a, a.lerp(b, 0.5), a.lerp(b, rng.span(0.0, 1.0))][i % 4];
            let (origin, direction) = (three(origin), three(aim - origin));
            let ray = Ray { origin, direction, t_min: R::from(0.0), t_max: R::INFINITY };
            let hit = accel.nearest(&ray, |_| true);
            // From inside, the back is what is seen.
            !hit.is_some_and(|h| h.back)
        })
        .count()
}

#[test]
fn packets_answer_as_single_rays() {
    let mut rng = Rng::new(5);
    let (positions, triangles) = soup(&mut rng, 300);
    let surface = Surface { positions: &positions, triangles: &triangles };
    let turn = glam::DAffine3::from_axis_angle(glam::DVec3::Y, 0.7);
    let moved = Placed { world_from_surface: Some(turn), cull_back: true, ..Placed::default() };
    let alone = World::new(Kind::Tree, &[surface], &[Placed::default()], 1);
    let two = World::new(Kind::Tree, &[surface], &[Placed::default(), moved], 1);
    let mut blocked = 0;
    for k in 0..1000 {
        // Towards a lamp, away from one, side by side, and all over the place; some too few to fill a packet.
        let (lamp, centre, spread) = (rng.point(3.0), rng.point(1.0), rng.span(0.0, 0.3));
        let rays: Vec<Ray<f32>> = (0..rng.below(PACKET) + 1)
            .map(|_| {
                let o = centre + rng.point(spread);
                let d = [lamp - o, o - lamp, lamp, rng.point(1.0)][k % 4];
                let t_max = if k % 8 < 5 { 1.0 } else { f32::INFINITY };
                Ray { origin: o.into(), direction: d.into(), t_min: 0.0, t_max }
            })
            .collect();
        for world in [&alone, &two] {
            let accept = |i: usize, h: &Hit<f32>| (h.triangle as usize + i) % 7 > 0;
            let want = |(i, r): (usize, &Ray<f32>)| (world.blocked(r, |h| accept(i, h)) as u32) << i;
            let want: u32 = rays.iter().enumerate().map(want).sum();
            assert_eq!(world.blocked_packet(&rays, accept), want, "{rays:?}");
            blocked += want.count_ones();
        }
    }
    assert!((2000..14000).contains(&blocked), "{blocked}");
}

#[test]
fn no_ray_gets_out_of_a_closed_surface() {
    assert_eq!((escapes::<f32>(100_000), escapes::<f64>(20_000)), (0, 0));
}

#[test]
#[ignore = "takes a minute"]
fn none_of_ten_million_rays_gets_out() {
    assert_eq!(escapes::<f32>(10_000_000), 0);
}
