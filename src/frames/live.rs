//! A character drawn as it is posed by hand, from a camera that is moved by hand: what editors show.

use super::bones::Figure;
use super::fit::Span;
use super::look::{self, Look};
use super::overlay::BonesDesc;
use super::worker::Worker;
use super::{FrameStats, Shading};
use crate::asset::Asset;
use crate::fk::{self, Posed};
use crate::image::Rgba8;
use crate::pose::Pose;
use crate::render::channel::IdImage;
use crate::render::raster::Stats;
use crate::render::{Renderer, Settings, Window};
use crate::scene::{Camera, Material, Object, Scene};
use crate::skeleton::BoneId;
use glam::{DVec3, Vec3};
use std::time::Instant;

/// Buffers for one asset. The asset is named at each call; it is always the same.
#[derive(Default)]
pub struct Live {
    worker: Worker,
    look: Look,
    materials: Vec<Material>,
    center: DVec3,
    figure: Option<(BonesDesc, Figure)>,
}

impl Live {
    /// Of the look, light, shading and materials count; there is no ground, and no effect that needs the whole picture.
    pub fn new(asset: &Asset, look: Look) -> Self {
        let mut worker = Worker::default();
        worker.evaluate(asset, None, 0.0);
        let center = asset.character.center(&worker.posed);
        Self { materials: look::materials(asset, &look), worker, look, center, figure: None }
    }

    /// The world point that the scene has its origin at: cameras are given relative to it.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Where the bones stand.
    pub fn posed(&self) -> &Posed {
        &self.worker.posed
    }

    /// Positions of all instances, in order, scene space.
    pub fn positions(&self) -> impl Iterator<Item = &[Vec3]> {
        self.worker.deformed.iter().map(|d| &d.positions[..])
    }

    /// Take a pose: forward kinematics, and deform what moved.
    ///
    /// # Panics
    /// If the pose is not of this character.
    pub fn pose(&mut self, asset: &Asset, pose: &Pose) -> FrameStats {
        let mut stats = FrameStats::default();
        let start = Instant::now();
        self.worker.pose.clone_from(pose);
        fk::forward(asset.character.skeleton(), pose, &mut self.worker.posed);
        let posed = Instant::now();
        stats.vertices = self.worker.deform(asset, self.center, 0);
        stats.bones = self.worker.posed.len();
        (stats.times.pose, stats.times.deform) = (posed - start, posed.elapsed());
        stats
    }

    /// Draw the pose that was taken last, before a colour (linear, premultiplied).
    ///
    /// # Panics
    /// If the settings do not pass [`Settings::check`].
    pub fn draw(
        &mut self,
        asset: &Asset,
        camera: &Camera,
        background: [f32; 4],
        settings: &Settings,
        out: &mut Rgba8,
    ) -> Stats {
        let mut painter = std::mem::take(&mut self.worker.painter);
        painter.renderer = Renderer::Raster;
        let stats = painter.draw(&self.scene(asset, camera, background), settings, out);
        self.worker.painter = painter;
        stats
    }

    /// Draw the skeleton of that pose, as in the notes §7.1, before nothing.
    ///
    /// # Panics
    /// If the settings do not pass [`Settings::check`].
    pub fn draw_bones(
        &mut self,
        asset: &Asset,
        bones: &BonesDesc,
        camera: &Camera,
        settings: &Settings,
        out: &mut Rgba8,
    ) -> Stats {
        let skeleton = asset.character.skeleton();
        if self.figure.as_ref().is_none_or(|f| f.0 != *bones) {
            let span = Span { asset, clip: None, center: self.center, shapes: None };
            self.figure = Some((bones.clone(), Figure::new(&span, bones, &mut Worker::default())));
        }
        let mut rasterizer = std::mem::take(&mut self.worker.painter.rasterizer);
        let (Some((_, figure)), posed) = (&self.figure, &self.worker.posed) else { return Stats::default() };
        let positions = figure.positions(skeleton, posed, self.center);
        let scene = figure.scene(self.scene(asset, camera, [0.0; 4]), &positions);
        let stats = rasterizer.draw(&scene, settings, out);
        self.worker.painter.rasterizer = rasterizer;
        stats
    }

    /// The bone that moves most of what is seen at a pixel, by the character's own labels; `None` where nothing is.
    ///
    /// # Panics
    /// If the settings do not pass [`Settings::check`].
    pub fn bone_at(
        &mut self,
        asset: &Asset,
        camera: &Camera,
        settings: &Settings,
        [x, y]: [usize; 2],
    ) -> Option<BoneId> {
        let mut ids = IdImage::default();
        let mut rasterizer = std::mem::take(&mut self.worker.painter.rasterizer);
        rasterizer.set_window(Some(Window { x, y, width: 1, height: 1 }));
        rasterizer.draw_ids(&self.scene(asset, camera, [0.0; 4]), settings, &mut ids);
        rasterizer.set_window(None);
        self.worker.painter.rasterizer = rasterizer;
        let instance = (*ids.objects.first()?).checked_sub(1)? as usize;
        let character = &asset.character;
        let mesh = character.mesh(&character.instances()[instance]);
        let corner = mesh.triangles.get(ids.triangles[0] as usize)?[0] as usize;
        character.main_bone(instance, corner)
    }

    fn scene<'s>(&'s self, asset: &'s Asset, camera: &Camera, background: [f32; 4]) -> Scene<'s> {
        let (character, facets) = (&asset.character, self.look.shading == Shading::Facets);
        let lit = look::lights(&self.look, &asset.lights, &self.worker.posed, self.center, camera);
        let plain = asset.materials.len();
        let objects = character.instances().iter().zip(&self.worker.deformed).map(|(i, d)| {
            let mesh = character.mesh(i);
            Object {
                mesh,
                positions: &d.positions,
                normals: if facets { &[] } else { &d.normals },
                tangents: &d.tangents,
                material: mesh.material.map_or(plain, |m| (m.0 as usize).min(plain)),
                mirrored: d.mirrored,
                labels: &[],
            }
        });
        Scene {
            camera: *camera,
            ambient: lit.ambient,
            lights: lit.lights,
            style: lit.style,
            background,
            objects: objects.collect(),
            shapes: &[],
            materials: &self.materials,
            textures: &asset.textures,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::character::{Binding, Character, Instance, MeshId};
    use crate::mesh::{Mesh, MeshData};
    use crate::scene::Projection;
    use crate::skeleton::{BoneDesc, Skeleton};

    #[test]
    fn a_pose_by_hand_is_drawn_and_its_bone_is_found() {
        let flag = BoneDesc { length: 1.0, ..BoneDesc::new("flag") };
        let (skeleton, of) = Skeleton::new(vec![flag]).unwrap();
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let data = MeshData { positions: corners.into(), triangles: vec![[0, 1, 2]], ..MeshData::default() };
        let instance = Instance { mesh: MeshId(0), binding: Binding::Bone(of[0]), first_weight: 0 };
        let mesh = Mesh::new(data).unwrap();
        let character = Character::new(skeleton, vec![mesh], vec![instance], vec![], vec![]).unwrap();
        let asset = Asset { character, ..Asset::default() };
        let mut live = Live::new(&asset, Look::default());
        let lens = Projection::Orthographic { height: 4.0 };
        let camera = Camera::look_at(Vec3::Z * 5.0, Vec3::ZERO, Vec3::Y, lens).unwrap();
        let settings = Settings { width: 40, height: 40, ..Settings::default() };
        let (mut picture, mut pose) = (Rgba8::default(), asset.character.rest_pose());
        let mut covered = |live: &mut Live, pose: &Pose| {
            let stats = live.pose(&asset, pose);
            live.draw(&asset, &camera, [0.0; 4], &settings, &mut picture);
            (stats.vertices, picture.data.chunks(4).filter(|p| p[3] > 0).count())
        };
        let (deformed, first) = covered(&mut live, &pose);
        assert!(deformed == 3 && (40..60).contains(&first), "{first}");
        assert_eq!(covered(&mut live, &pose), (0, first));
        assert_eq!(live.bone_at(&asset, &camera, &settings, [22, 17]), Some(of[0]));
        assert_eq!(live.bone_at(&asset, &camera, &settings, [2, 2]), None);
        pose.locals[0].translation.x = 9.0;
        assert_eq!(covered(&mut live, &pose), (3, 0));
        live.pose(&asset, &asset.character.rest_pose());
        live.draw_bones(&asset, &BonesDesc::default(), &camera, &settings, &mut picture);
        assert!(picture.data.chunks(4).any(|p| p[3] > 0));
    }
}
