use super::*;
use crate::test_rng::Rng;

const KINDS: [Kind; 4] = [Kind::Brute, Kind::Tree, Kind::Octree, Kind::Grid];

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

/// All give the same to the last bit.
fn agree<R: Real>(kinds: &[Accel], rays: usize) {
    let mut rng = Rng::new(7);
    let mut hits = 0;
    for _ in 0..rays {
        let mut r = ray::<R>(&mut rng);
        if rng.below(3) == 0 {
            r.t_max = R::from(rng.span(0.0, 2.0));
        }
        hits += same(kinds, &r).is_some() as usize;
    }
    assert!(hits > rays / 4 && hits < rays, "{hits} of {rays}");
}

/// The hit that all kinds find.
fn same<R: Real>(kinds: &[Accel], ray: &Ray<R>) -> Option<Hit<R>> {
    let odd = |h: &Hit<R>| !h.triangle.is_multiple_of(5);
    let first = kinds[0].nearest(ray, |_| true);
    for k in kinds {
        assert_eq!(k.nearest(ray, |_| true), first, "{:?} {ray:?}", k.kind);
        assert_eq!(k.nearest(ray, odd), kinds[0].nearest(ray, odd), "{:?} {ray:?}", k.kind);
        assert_eq!(k.blocked(ray, |_| true), first.is_some(), "{:?} {ray:?}", k.kind);
    }
    first
}

fn all_kinds(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Accel> {
    let mut all: Vec<Accel> = KINDS.map(|k| Accel::new(k, positions, triangles, 1)).into();
    all.push(all[1].clone().with_isa(Isa::Portable));
    all
}

#[test]
fn every_kind_and_both_builds_give_the_same_hits() {
    for (n, size) in [(1, 1.0), (5, 1.0), (700, 1.0), (700, 1e-3), (700, 1e4)] {
        let (mut positions, triangles) = soup(&mut Rng::new(1), n);
        positions.iter_mut().for_each(|p| *p *= size);
        let kinds = all_kinds(&positions, &triangles);
        if size == 1.0 && n > 5 {
            agree::<f32>(&kinds, 3000);
            agree::<f64>(&kinds, 1000);
        }
        let mut rng = Rng::new(2);
        for _ in 0..300 {
            let mut r = ray::<f32>(&mut rng);
            r.origin = r.origin.map(|x| x * size * 30.0);
            let aim = positions[rng.below(positions.len())].to_array();
            r.direction = std::array::from_fn(|k| aim[k] - r.origin[k]);
            same(&kinds, &r);
        }
    }
}

#[test]
fn axes_planes_and_corners_do_not_matter() {
    // Two flat squares at one place and one above, on round numbers.
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for z in [0.0, 0.0, 1.0] {
        let n = positions.len() as u32;
        positions.extend([[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]].map(|[x, y]| Vec3::new(x, y, z)));
        triangles.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
    }
    let kinds = all_kinds(&positions, &triangles);
    let ray = |o: [f32; 3], d: [f32; 3]| Ray { origin: o, direction: d, t_min: 0.0, t_max: 9.0f32 };
    let t = |o, d| same(&kinds, &ray(o, d)).map(|h| (h.t, h.triangle));
    // Zeros of both signs; origins on slabs, at corners and on edges; of equal hits the lowest triangle.
    for zero in [0.0, -0.0] {
        assert_eq!(t([0.5, 0.25, -5.0], [zero, zero, 1.0]), Some((5.0, 0)));
        assert_eq!(t([1.0, 1.0, -5.0], [zero, -zero, 1.0]), Some((5.0, 0)));
        assert_eq!(t([-1.0, 0.5, 5.0], [-zero, zero, -1.0]), Some((4.0, 5)));
        assert_eq!(t([0.5, 0.25, zero], [zero, zero, 1.0]), Some((0.0, 0)));
        assert_eq!(t([1.5, 0.25, -5.0], [zero, zero, 1.0]), None);
        // Along a flat box: in its plane nothing is hit.
        assert_eq!(t([-3.0, 0.5, zero], [1.0, zero, zero]), None);
    }
    assert_eq!(t([-3.0, 0.0, -3.0], [1.0, 0.0, 1.0]), Some((3.0, 0)));
    let short = Ray { t_max: 5.0, t_min: 5.0, ..ray([0.5, 0.25, -5.0], [0.0, 0.0, 1.0]) };
    assert_eq!(same(&kinds, &short).map(|h| h.t), Some(5.0));
    assert_eq!(same(&kinds, &Ray { t_max: 4.999, t_min: 0.0, ..short }), None);
    // No rays at all.
    for bad in
        [[0.0; 3], [f32::NAN, 0.0, 1.0], [f32::INFINITY, 0.0, 1.0], [0.0, 0.0, 1e30], [0.0, 0.0, 1e-30]]
    {
        assert_eq!(t([0.5, 0.25, -5.0], bad), None);
    }
    assert_eq!(t([f32::NAN, 0.0, -1.0], [0.0, 0.0, 1.0]), None);
    assert_eq!(t([0.0, 0.0, f32::NEG_INFINITY], [0.0, 0.0, 1.0]), None);
}

#[test]
fn what_cannot_be_split_is_still_found() {
    let mut rng = Rng::new(9);
    let triangle = [Vec3::new(-1.0, -1.0, 0.5), Vec3::new(1.0, -1.0, 0.5), Vec3::new(0.0, 1.0, 0.5)];
    // A thousand triangles at one place; each larger than the one before, to the end of the numbers; nowhere; none.
    let stack: Vec<Vec3> = (0..1000).flat_map(|_| triangle).collect();
    let far: Vec<Vec3> = (0..1200).map(|i| triangle[i % 3] * 1.06f32.powi(i as i32)).collect();
    let nowhere: Vec<Vec3> =
        (0..300).map(|i| if i % 7 == 0 { Vec3::NAN } else { rng.point(f32::MAX) }).collect();
    for positions in [stack, far, nowhere, vec![]] {
        let n = positions.len() as u32 / 3;
        let triangles: Vec<[u32; 3]> = (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let kinds = all_kinds(&positions, &triangles);
        let (origin, direction) = ([0.0, 0.0, -1.0], [0.0, 0.0, 1.0f32]);
        let hit = same(&kinds, &Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY });
        assert!(n != 1000 || hit.is_some_and(|h| h.triangle == 0 && h.t == 1.5), "{hit:?}");
        assert_eq!(kinds[0].bounds().is_some(), n > 0);
        (0..100).for_each(|_| _ = same(&kinds, &self::ray::<f32>(&mut rng)));
    }
}

#[test]
fn a_triangle_is_in_a_cell_that_holds_none_of_its_corners() {
    let [x, y, z] = glam::DVec3::AXES;
    let plane = [x * 9.0 - y * 9.0, y * 9.0 - z * 9.0, z * 9.0 - x * 9.0];
    let half = glam::DVec3::splat(0.5);
    assert!(overlap::meets(plane, glam::DVec3::ZERO, half));
    assert!(!overlap::meets(plane, glam::DVec3::splat(0.6), half));
    assert!(overlap::meets([x, x, x], x, half));
}

#[test]
fn threads_do_not_matter_and_fitting_again_answers_as_building_anew() {
    let (positions, triangles) = closed(12_000);
    let one = Accel::new(Kind::Tree, &positions, &triangles, 1);
    let text = |a: &Accel| format!("{:?}", (&a.nodes, &a.packs, &a.cuts, a.built));
    assert_eq!(text(&one), text(&Accel::new(Kind::Tree, &positions, &triangles, 3)));
    let bent: Vec<Vec3> = positions.iter().map(|p| *p + Vec3::X * 0.2 * (3.0 * p.y).sin()).collect();
    let [mut a, mut b] = [one.clone(), one.clone()];
    assert!(!a.update(&bent, 1) && !b.update(&bent, 3));
    assert_eq!(text(&a), text(&b));
    let anew = Accel::new(Kind::Tree, &bent, &triangles, 2);
    assert_eq!(a.bounds(), anew.bounds());
    let mut rng = Rng::new(8);
    let kinds = [a, anew];
    for _ in 0..2000 {
        let (origin, direction) = (rng.point(0.4).to_array(), rng.point(1.0).to_array());
        same(&kinds, &Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY });
    }
    // Shuffled beyond recognition, it is built anew, and then is what it would have been.
    let wild: Vec<Vec3> = positions.iter().map(|_| rng.point(1.0)).collect();
    assert!(b.update(&wild, 2));
    assert_eq!(text(&b), text(&Accel::new(Kind::Tree, &wild, &triangles, 1)));
}

#[test]
fn a_moved_object_is_hit_where_it_is() {
    let mut rng = Rng::new(4);
    let (positions, triangles) = soup(&mut rng, 60);
    let surface = Surface { positions: &positions, triangles: &triangles };
    let mut place = |i: usize| {
        let turn = glam::DQuat::from_rotation_arc(glam::DVec3::X, rng.point(1.0).as_dvec3().normalize());
        let scale = glam::DVec3::new(if i.is_multiple_of(2) { -0.5 } else { 0.5 }, 0.5, 0.5);
        glam::DAffine3::from_scale_rotation_translation(scale, turn, rng.point(2.0).as_dvec3())
    };
    let mut placed: Vec<Placed> = (0..40)
        .map(|i| Placed {
            world_from_surface: Some(place(i)),
            cull_back: i.is_multiple_of(3),
            ..Placed::default()
        })
        .collect();
    let mut worlds = KINDS.map(|k| World::new(k, &[surface], &placed, 2));
    placed[7].world_from_surface = None;
    for w in &mut worlds {
        let moved = Motion::Moved { object: 7, world_from_surface: None };
        assert_eq!(w.update(&[moved], 2), Updated::default());
    }
    let mut hits = 0;
    for _ in 0..1000 {
        let ray = ray::<f64>(&mut rng);
        let found = worlds.each_ref().map(|w| w.nearest(&ray, |_| true));
        found.iter().for_each(|f| assert_eq!(*f, found[0], "{ray:?}"));
        assert_eq!(worlds[1].blocked(&ray, |_| true), found[0].is_some());
        let Some(h) = found[0] else { continue };
        hits += 1;
        // The point on the ray is the point on the triangle, and the side is the side in the world.
        let m = placed[h.object as usize].world_from_surface.unwrap_or_default();
        let corner = |i: u32| m.transform_point3(positions[i as usize].as_dvec3());
        let [a, b, c] = triangles[h.triangle as usize].map(corner);
        let (o, d) = (glam::DVec3::from(ray.origin), glam::DVec3::from(ray.direction));
        assert!((o + d * h.t).distance(a * (1.0 - h.u - h.v) + b * h.u + c * h.v) < 1e-9);
        let mirrored = m.matrix3.determinant() < 0.0;
        assert_eq!(h.back, ((b - a).cross(c - a).dot(d) > 0.0) != mirrored);
        assert!(!(h.back && placed[h.object as usize].cull_back));
    }
    assert!(hits > 200, "{hits}");
}

#[test]
fn the_nearest_points_are_those_of_looking_at_every_triangle() {
    let (positions, triangles) = soup(&mut Rng::new(6), 400);
    let kinds = all_kinds(&positions, &triangles);
    let mut rng = Rng::new(12);
    for i in 0..10_000 {
        let p = rng.point(2.0).as_dvec3();
        let want = kinds[0].closest(p, f64::INFINITY);
        assert_eq!(kinds[1].closest(p, f64::INFINITY), want, "{p}");
        if i % 20 == 0 {
            let nine = kinds[0].k_closest(p, 9, 1.0);
            kinds[1..4].iter().for_each(|k| assert_eq!(k.k_closest(p, 9, 1.0), nine, "{:?} {p}", k.kind));
            assert!(nine.is_sorted_by_key(|c| c.distance) && nine.iter().all(|c| c.distance <= 1.0));
            // No other point of a triangle is nearer, as far as sampling can tell.
            let t = triangles[rng.below(400)].map(|i| positions[i as usize].as_dvec3());
            let (u, v) = (rng.range(0.0, 0.5), rng.range(0.0, 0.5));
            let any = t[0] * (1.0 - u - v) + t[1] * u + t[2] * v;
            assert!(want.is_some_and(|c| c.distance <= any.distance(p)));
        }
    }
    assert!(kinds[1].closest(glam::DVec3::NAN, 1.0).is_none());
}

#[test]
fn triangles_that_pass_through_each_other() {
    let (positions, triangles) = soup(&mut Rng::new(13), 300);
    let (other, same) = soup(&mut Rng::new(14), 200);
    let kinds = all_kinds(&positions, &triangles);
    let others = all_kinds(&other, &same);
    let (own, both) = (kinds[0].self_crossings(), kinds[0].crossings(&others[0]));
    assert!(own.len() > 30 && both.len() > 30, "{} {}", own.len(), both.len());
    for (a, b) in kinds.iter().zip(&others) {
        assert_eq!((a.self_crossings(), a.crossings(b)), (own.clone(), both.clone()), "{:?}", a.kind);
    }
    // A closed surface does not cross itself; a pole pushed out through the other side crosses what is there.
    let (mut p, t) = closed(2000);
    assert_eq!(Accel::new(Kind::Tree, &p, &t, 1).self_crossings(), [[0; 2]; 0]);
    p[0].y = -2.0;
    let through = Accel::new(Kind::Tree, &p, &t, 1).self_crossings();
    let spike = |i: u32| t[i as usize].contains(&0);
    assert!(!through.is_empty() && through.iter().all(|&[a, b]| spike(a) != spike(b)), "{through:?}");
    // Neighbours at a corner that do overlap, and that do not.
    let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, -1.0)];
    let crossed = |p: &[Vec3]| Accel::new(Kind::Tree, p, &[[0, 1, 2], [0, 3, 4]], 1).self_crossings().len();
    assert_eq!(crossed(&p), 1);
    assert_eq!(crossed(&p.map(|q| if q.z == 0.0 { q } else { -q })), 0);
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
            let accept = |i: usize, h: &Hit<f32>| !(h.triangle as usize + i).is_multiple_of(7);
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
    assert_eq!((escapes::<f32>(10_000_000), escapes::<f64>(20_000)), (0, 0));
}
