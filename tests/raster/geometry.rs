//! Which triangle is where.

use super::*;
use glam::{DVec3, Mat4};

/// What a ray through a pixel's centre meets: object + 1, triangle, distance along the view direction.
enum Cast {
    Hit(u32, u32, f64),
    Miss,
    /// Too near to an edge, to another surface or to the near plane to be sure in f32.
    Unsure,
}

/// The nearest triangle by brute force in f64.
fn cast(stage: &Stage, size: usize, x: usize, y: usize) -> Cast {
    let camera = &stage.camera;
    let axes = camera.scene_from_view.matrix3;
    let [right, up, back] = [axes.x_axis, axes.y_axis, axes.z_axis].map(|a| Vec3::from(a).as_dvec3());
    let eye = camera.eye().as_dvec3();
    let at = |i: usize| (i as f64 + 0.5) / size as f64 * 2.0 - 1.0;
    let (u, v) = (at(x), -at(y));
    let (origin, direction) = match camera.projection {
        Projection::Perspective { fov_y } => {
            let f = (fov_y as f64 * 0.5).tan();
            (eye, right * (u * f) + up * (v * f) - back)
        }
        Projection::Orthographic { height } => {
            let h = height as f64 * 0.5;
            (eye + right * (u * h) + up * (v * h), -back)
        }
    };
    let (mut best, mut second, mut unsure) = ((f64::INFINITY, 0, 0), f64::INFINITY, f64::INFINITY);
    for (o, (mesh, _)) in stage.meshes.iter().enumerate() {
        for (f, t) in mesh.triangles.iter().enumerate() {
            let p = t.map(|i| mesh.positions[i as usize].as_dvec3());
            let Some((b, distance)) = meet(p, origin, direction) else { continue };
            let near = camera.near as f64;
            let least = b.x.min(b.y).min(b.z);
            if distance < near * 0.99 || least < -0.02 {
                continue;
            }
            if least < 0.02 || distance < near * 1.01 {
                unsure = unsure.min(distance);
            } else if distance < best.0 {
                second = best.0;
                best = (distance, o as u32 + 1, f as u32);
            } else {
                second = second.min(distance);
            }
        }
    }
    match best {
        (d, _, _) if unsure < 1.001 * d || second < 1.001 * d => Cast::Unsure,
        (d, _, _) if d.is_infinite() => Cast::Miss,
        (d, object, triangle) => Cast::Hit(object, triangle, d),
    }
}

/// Barycentric coordinates and parameter of a line's intersection with a triangle's plane.
fn meet(p: [DVec3; 3], origin: DVec3, direction: DVec3) -> Option<(DVec3, f64)> {
    let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
    let n = e1.cross(e2);
    let det = -direction.dot(n);
    if det.abs() < 1e-12 {
        return None;
    }
    let s = origin - p[0];
    let q = s.cross(direction);
    let (b1, b2) = (e2.dot(q) / det, -e1.dot(q) / det);
    Some((DVec3::new(1.0 - b1 - b2, b1, b2), s.dot(n) / det))
}

fn soup(seed: u64, objects: usize, reach: f32) -> Vec<(Mesh, usize)> {
    let mut rng = Rng::new(seed);
    let mut one = |_| {
        let positions: Vec<Vec3> = (0..60).map(|_| rng.point(reach)).collect();
        (mesh(positions, (0..20).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()), 0)
    };
    (0..objects).map(&mut one).collect()
}

fn agrees(stage: &Stage, size: usize, least_sure: usize) -> usize {
    let (ids, _) = stage.ids(size);
    let (mut sure, mut hits) = (0, 0);
    for at in 0..size * size {
        let found = (ids.objects[at], ids.triangles[at], ids.depth[at]);
        match cast(stage, size, at % size, at / size) {
            Cast::Unsure => continue,
            Cast::Miss => assert_eq!(found, (0, 0, f32::INFINITY), "pixel {} {}", at % size, at / size),
            Cast::Hit(object, triangle, d) => {
                hits += 1;
                assert_eq!((found.0, found.1), (object, triangle), "pixel {} {}", at % size, at / size);
                assert!((found.2 as f64 - d).abs() < 1e-3 * d, "{} {d}", found.2);
            }
        }
        sure += 1;
    }
    assert!(sure >= least_sure, "only {sure} pixels are off the edges");
    hits
}

#[test]
fn ids_and_depths_are_the_ray_casters() {
    for seed in 0..4 {
        let mut stage = Stage::of(from_front(5.0, 4.0), Mesh::default(), material(Vec4::ONE));
        stage.meshes = soup(seed, 3, 1.5);
        assert!(agrees(&stage, 96, 5000) > 1000);
        stage.camera = perspective(Vec3::new(1.0, 2.0, 4.0), Vec3::ZERO, 0.9);
        assert!(agrees(&stage, 96, 5000) > 1000);
    }
}

#[test]
fn triangles_through_the_eye_are_cut() {
    // The eye stands in the middle of the soup: a good part of the triangles reaches behind it.
    for seed in 10..14 {
        let mut stage =
            Stage::of(perspective(Vec3::ZERO, -Vec3::Z, 1.2), Mesh::default(), material(Vec4::ONE));
        stage.camera.near = 0.05;
        stage.meshes = soup(seed, 2, 2.0);
        assert!(agrees(&stage, 96, 4000) > 1000);
        assert!(stage.ids(96).1.clipped > 3);
    }
}

#[test]
fn a_floor_under_the_eye_ends_at_the_horizon() {
    let floor = quad(1000.0, 0.0);
    let turn = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let positions = floor.positions.iter().map(|p| turn.transform_point3(*p)).collect();
    let camera = perspective(Vec3::Y, Vec3::new(0.0, 1.0, -1.0), 1.0);
    let stage = Stage::of(camera, mesh(positions, floor.triangles.clone()), material(Vec4::ONE));
    let (ids, stats) = stage.ids(64);
    // The diagonal lies 45° off the view, so the second triangle is cut too, but lies beside the picture.
    assert_eq!((stats.clipped, stats.drawn, stats.culled, stats.missed), (1, 1, 0, 1));
    for (at, &o) in ids.objects.iter().enumerate() {
        assert_eq!(o, (at / 64 >= 32) as u32, "row {}", at / 64);
    }
}

/// Convex polygons in a grid of cells, cut into triangles from a point within, or from their first corner.
fn polygons(rng: &mut Rng, cells: usize, cell: f32, half: f32) -> [Mesh; 2] {
    let (mut p, mut star, mut fan) = (vec![], vec![], vec![]);
    for c in 0..cells * cells {
        let center = Vec3::new((c % cells) as f32 + 0.5, (c / cells) as f32 + 0.5, 0.0) * cell
            - Vec3::new(half, half, 0.0);
        let (n, first) = (5 + (rng.next() % 5) as u32, p.len() as u32);
        let (radius, turn) = (rng.span(0.1, 0.45) * cell, rng.span(0.0, 6.0));
        p.push(center + Vec3::new(rng.span(-0.2, 0.2), rng.span(-0.2, 0.2), 0.0) * radius);
        for k in 0..n {
            let angle = turn + (k as f32 + rng.span(-0.3, 0.3)) * std::f32::consts::TAU / n as f32;
            p.push(center + Vec3::new(angle.cos(), angle.sin(), 0.0) * radius);
            star.push([first, first + 1 + k, first + 1 + (k + 1) % n]);
            if k > 1 {
                fan.push([first + 1, first + k, first + 1 + k]);
            }
        }
    }
    [mesh(p.clone(), star), mesh(p, fan)]
}

#[test]
fn shared_edges_are_covered_exactly_once() {
    let mut rng = Rng::new(7);
    let mut cells = 0;
    for (per_side, cell) in [(200, 5.0), (150, 7.0), (200, 4.0), (70, 15.0), (80, 12.0)] {
        let size = (per_side as f32 * cell) as usize;
        let [star, fan] = polygons(&mut rng, per_side, cell, 0.5 * size as f32);
        let camera = from_front(5.0, size as f32);
        cells += per_side * per_side;

        // Layers of transparent triangles are counted one by one, opaque ones once a pixel.
        let layers = Stage::of(camera, star.clone(), blending(Vec3::ONE, 0.5)).linear(size, 1).1.shaded;
        let whole = Stage::of(camera, star, material(Vec4::ONE)).ids(size).0;
        let covered = whole.objects.iter().filter(|o| **o != 0).count();
        assert_eq!(layers, covered as u64, "some pixel is covered twice");

        // The same outlines cut in another way cover the same pixels: there is no gap along inner edges.
        let other = Stage::of(camera, fan, material(Vec4::ONE)).ids(size).0;
        assert!(whole.objects == other.objects, "the cut shows");
    }
    assert!(cells >= 100_000, "{cells}");
}

#[test]
fn four_samples_cover_as_much_as_there_is() {
    // Transparent at 4 samples: each triangle's share of a pixel adds up to the area.
    let mut rng = Rng::new(9);
    let [star, _] = polygons(&mut rng, 20, 10.0, 100.0);
    let area: f64 = star
        .triangles
        .iter()
        .map(|t| {
            let p = t.map(|i| star.positions[i as usize]);
            0.5 * (p[1] - p[0]).cross(p[2] - p[0]).z as f64
        })
        .sum();
    let stage = Stage::of(from_front(5.0, 200.0), star, material(Vec4::ONE));
    let (picture, stats) = stage.linear(200, 4);
    let alpha: f64 = picture.pixels.iter().map(|p| p[3] as f64).sum();
    assert_eq!(alpha * 4.0, stats.samples as f64);
    assert!((alpha / area - 1.0).abs() < 0.01, "{alpha} {area}");
    assert!(picture.pixels.iter().all(|p| [0.0, 0.25, 0.5, 0.75, 1.0].contains(&p[3]) && p[0] == p[3]));

    // An upright edge crosses the four columns of samples one by one.
    for (shift, want) in [(0.0, 0.0), (0.25, 0.25), (0.5, 0.5), (0.75, 0.75), (1.0, 1.0)] {
        let p = vec![
            Vec3::new(-9.0, -9.0, 0.0),
            Vec3::new(shift, -9.0, 0.0),
            Vec3::new(shift, 9.0, 0.0),
            Vec3::new(-9.0, 9.0, 0.0),
        ];
        let stage = Stage::of(from_front(5.0, 4.0), mesh(p, vec![[0, 1, 2], [0, 2, 3]]), material(Vec4::ONE));
        assert_eq!(stage.linear(4, 4).0.pixels[2][3], want);
    }
}

#[test]
fn backs_are_culled_unless_mirrored_or_double_sided() {
    let one_sided = Material { double_sided: false, ..material(Vec4::ONE) };
    let mut data = quad(1.0, 0.0);
    let mut stage = Stage::of(from_front(5.0, 2.0), Mesh::new(data.clone()).unwrap(), one_sided);
    assert_eq!(stage.ids(8).1.samples, 0, "identities count no colours");
    assert_eq!(
        stage.linear(8, 1).1,
        Stats { triangles: 2, vertices: 4, drawn: 2, samples: 64, shaded: 64, ..Default::default() }
    );
    data.triangles = vec![[0, 2, 1], [0, 3, 2]];
    stage.meshes[0].0 = Mesh::new(data).unwrap();
    assert_eq!(stage.linear(8, 1).1, Stats { triangles: 2, vertices: 4, culled: 2, ..Default::default() });
    let mut scene = stage.scene();
    scene.objects[0].mirrored = true;
    let settings = Settings { width: 8, height: 8, samples: 1, threads: 1 };
    let stats = Rasterizer::default().draw_linear(&scene, &settings, &mut Image::default());
    assert_eq!((stats.drawn, stats.samples), (2, 64));
    stage.materials[0].double_sided = true;
    assert_eq!(stage.linear(8, 1).1.drawn, 2);
}

#[test]
fn equal_depths_go_to_the_first() {
    let both = [Mesh::new(quad(1.0, 0.0)).unwrap(), Mesh::new(quad(1.0, 0.0)).unwrap()];
    let mut stage = Stage::of(from_front(5.0, 2.0), both[0].clone(), material(Vec4::ONE));
    stage.meshes.push((both[1].clone(), 0));
    assert!(stage.ids(32).0.objects.iter().all(|&o| o == 1));

    // Of one mesh, too, where one is so long that it takes another way than the other.
    let ring = |r: f32| [Vec3::new(-r, -r, 0.0), Vec3::new(r, -r, 0.0), Vec3::new(0.0, r, 0.0)];
    for (outer, inner) in [(0, 1), (1, 0)] {
        let mut corners = [ring(0.9); 2];
        corners[inner] = ring(0.1);
        let both = mesh(corners.concat(), vec![[0, 1, 2], [3, 4, 5]]);
        let stage = Stage::of(from_front(5.0, 2.0), both, material(Vec4::ONE));
        let count = |ids: &IdImage, t| {
            ids.objects.iter().zip(&ids.triangles).filter(|&(&o, &found)| o == 1 && found == t).count()
        };
        let ids = stage.ids(256).0;
        assert!(count(&ids, outer as u32) > 20_000, "the outer covers 200 pixels each way");
        assert_eq!(count(&ids, inner as u32) > 0, inner == 0, "the inner is seen if it comes first");
    }
}
