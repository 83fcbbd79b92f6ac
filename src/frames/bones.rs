//! Bones as bodies: a pyramid from a square base at the bone's origin to its tip (notes §7.1).

use super::fit::Span;
use super::overlay::BonesDesc;
use super::worker::Worker;
use crate::fk::Posed;
use crate::image::color::linear_from_srgb;
use crate::mesh::{Mesh, MeshData};
use crate::scene::{Light, LightKind, Material, Object, Scene, Style};
use crate::skeleton::{BoneId, Skeleton};
use glam::{DVec3, Vec3, Vec4};
use std::sync::LazyLock;

/// Half the side of a base: in lengths of its bone, and at most so many usual lengths.
const HALF_SIDE: f32 = 0.09;
const MOST_USUAL: f32 = 0.16;

/// Radius of the mark of a bone without length, in usual lengths.
const MARK: f32 = 0.1;

/// The skeleton of a shot.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    mesh: Mesh,
    /// Half the base's side over the bone's length; none for bones that are marked only.
    slimness: Vec<Option<f32>>,
    /// Radius of marks, metres.
    mark: f32,
}

/// Tip, then the corners of the base, of a bone of length 1 and half side 1.
const PYRAMID: [[f32; 3]; 5] =
    [[1.0, 0.0, 0.0], [0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]];
const PYRAMID_FACES: [[u32; 3]; 6] = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [1, 4, 3], [1, 3, 2]];

const MARK_CORNERS: [[f32; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
const MARK_FACES: [[u32; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

static MATERIALS: LazyLock<[Material; 1]> = LazyLock::new(|| {
    let name = "bone".into();
    [Material { name, diffuse: Vec4::ONE, specular: Vec3::ZERO, double_sided: true, ..Material::default() }]
});

impl Figure {
    /// Sizes from the rest pose; colours by place in the skeleton.
    pub fn new(span: &Span, desc: &BonesDesc, worker: &mut Worker) -> Self {
        worker.evaluate(span.asset, None, 0.0);
        let skeleton = span.asset.character.skeleton();
        let reach = |b: BoneId| worker.posed.near(b, span.center).transform_vector3(skeleton.tip(b)).length();
        let lengths: Vec<f32> = skeleton.ids().map(reach).collect();
        let usual = usual(&lengths, skeleton, &worker.posed);
        let slim = |&length: &f32| {
            let fine = length > 1e-4 * usual && length.is_finite();
            fine.then(|| HALF_SIDE.min(MOST_USUAL * usual / length))
        };
        let slimness: Vec<Option<f32>> = lengths.iter().map(slim).collect();
        Self { mesh: body(&slimness, desc), slimness, mark: MARK * usual }
    }

    /// Where the corners are in a pose, scene space.
    pub fn positions(&self, skeleton: &Skeleton, posed: &Posed, center: DVec3) -> Vec<Vec3> {
        let mut out = Vec::with_capacity(self.mesh.positions.len());
        for (bone, slimness) in skeleton.ids().zip(&self.slimness) {
            let scene_from_bone = posed.near(bone, center);
            let (aim, length) = (skeleton.aim(bone), skeleton.length(bone));
            match slimness {
                Some(slim) => out.extend(PYRAMID.map(|[x, y, z]| {
                    let p = length * Vec3::new(x, y * slim, z * slim);
                    scene_from_bone.transform_point3(aim * p)
                })),
                None => out.extend(
                    MARK_CORNERS.map(|p| Vec3::from(scene_from_bone.translation) + self.mark * Vec3::from(p)),
                ),
            }
        }
        out
    }

    /// The scene of the skeleton alone, under a light that stands with the camera.
    pub fn scene<'s>(&'s self, of_character: Scene<'s>, positions: &'s [Vec3]) -> Scene<'s> {
        let from = Vec3::new(-0.45, 0.7, 0.6).normalize();
        let direction = -of_character.camera.scene_from_view.transform_vector3(from);
        let mesh = &self.mesh;
        let object = Object {
            mesh,
            positions,
            normals: &[],
            tangents: &[],
            material: 0,
            mirrored: false,
            labels: &[],
        };
        Scene {
            ambient: Vec3::splat(0.3),
            lights: vec![Light::new(LightKind::Directional { direction }, Vec3::splat(0.85))],
            style: Style::default(),
            background: [0.0; 4],
            objects: vec![object],
            shapes: &[],
            materials: &*MATERIALS,
            textures: &[],
            ..of_character
        }
    }
}

/// The length that half of the bones reach; where none has any, a twentieth of the way from end to end of the skeleton.
fn usual(lengths: &[f32], skeleton: &Skeleton, posed: &Posed) -> f32 {
    let mut sorted: Vec<f32> = lengths.iter().copied().filter(|l| *l > 1e-9 && l.is_finite()).collect();
    sorted.sort_by(f32::total_cmp);
    if let Some(&middle) = sorted.get(sorted.len() / 2) {
        return middle;
    }
    let origins = || skeleton.ids().map(|b| posed.origin(b));
    let (low, high) = (origins().reduce(DVec3::min), origins().reduce(DVec3::max));
    let extent = (high.unwrap_or_default() - low.unwrap_or_default()).max_element() as f32;
    if extent > 0.0 && extent.is_finite() { 0.05 * extent } else { 1.0 }
}

/// One mesh for all bones: triangles and colours; where the corners are is said for each frame.
fn body(slimness: &[Option<f32>], desc: &BonesDesc) -> Mesh {
    let mut data = MeshData { name: "bones".into(), ..MeshData::default() };
    for (i, slim) in slimness.iter().enumerate() {
        let first = data.positions.len() as u32;
        let (corners, faces): (&[[f32; 3]], &[[u32; 3]]) = match slim {
            Some(_) => (&PYRAMID, &PYRAMID_FACES),
            None => (&MARK_CORNERS, &MARK_FACES),
        };
        data.positions.extend(corners.iter().map(|p| Vec3::from(*p)));
        data.colors.extend(corners.iter().map(|_| color(BoneId(i as u32), desc)));
        data.triangles.extend(faces.iter().map(|t| t.map(|v| first + v)));
    }
    Mesh::new(data).expect("lists of one length, indices in range, finite numbers")
}

/// Its own hue, a golden section of the circle from the bone before; or whether it is selected.
fn color(bone: BoneId, desc: &BonesDesc) -> Vec4 {
    let srgb = match () {
        _ if desc.selected.contains(&bone) => [1.0, 0.52, 0.05],
        _ if !desc.selected.is_empty() => [0.62, 0.64, 0.68],
        _ => hue((0.08 + 0.618_034 * f64::from(bone.0)).fract() as f32),
    };
    let [r, g, b] = srgb.map(linear_from_srgb);
    Vec4::new(r, g, b, 1.0)
}

/// sRGB of a hue of 0…1, light and not too strong.
fn hue(h: f32) -> [f32; 3] {
    [0.0, 4.0, 2.0].map(|offset| {
        let k = (6.0 * h + offset).rem_euclid(6.0);
        let full = ((k - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        0.97 * (1.0 - 0.62 * (1.0 - full))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bone_has_five_corners_and_six_triangles_and_is_closed() {
        for (corners, faces) in [(&PYRAMID[..], &PYRAMID_FACES[..]), (&MARK_CORNERS[..], &MARK_FACES[..])] {
            let positions: Vec<Vec3> = corners.iter().map(|p| Vec3::from(*p)).collect();
            // Each edge is run through once each way.
            let edges = || faces.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
            assert!(edges().all(|[a, b]| edges().filter(|e| *e == [b, a]).count() == 1));
            // Six volumes of tetrahedra from the inside are positive: faces look outwards.
            let inside = positions.iter().sum::<Vec3>() / positions.len() as f32;
            for t in faces {
                let [a, b, c] = t.map(|v| positions[v as usize] - inside);
                assert!(a.cross(b).dot(c) > 0.0, "{t:?}");
            }
        }
        assert_eq!((PYRAMID.len(), PYRAMID_FACES.len()), (5, 6));
    }
}
