//! What the pixels of a moment show, beside their colour.

use super::{FrameStats, Moment, Shot, Worker};
use crate::character::{Binding, Character, Instance};
use crate::render::channel::{Channel, Channels};
use crate::scene::{AlphaMode, Material, Scene};
use glam::DVec3;

/// Half an 8-bit step: whatever blends with more than that is visible.
const VISIBLE: f32 = 0.5 / 255.0;

impl Shot<'_> {
    /// What the pixels of a moment show, with the samples that the shot's pictures have.
    ///
    /// Objects are the character's mesh instances, in order. Labels are bones, counted from 1: of each vertex the one with the strongest
    /// weight. Positions are in world space. A surface that blends counts where nothing lies behind it: then it is what the pixel shows, so
    /// that wherever a picture of the character has alpha there is a surface.
    pub fn draw_channels(
        &self,
        moment: impl Into<Moment>,
        worker: &mut Worker,
        wanted: &[Channel],
        out: &mut Channels,
    ) -> FrameStats {
        let settings = &self.desc.settings;
        let solid = solid(&self.materials);
        if wanted.contains(&Channel::Label) {
            let character = &self.asset.character;
            self.labels.get_or_init(|| character.instances().iter().map(|i| labels(character, i)).collect());
        }
        let stats = self.with_scene(moment.into(), worker, |scene, rasterizer| {
            let stats = rasterizer.draw_channels(scene, settings, wanted, out);
            if let Some(materials) = &solid {
                let mut all = Channels::default();
                let scene = Scene { materials, ..scene.clone() };
                rasterizer.draw_channels(&scene, settings, wanted, &mut all);
                let empty = (0..all.objects.len()).filter(|&i| out.objects[i] == 0).collect::<Vec<_>>();
                empty.into_iter().for_each(|i| out.copy_pixel(i, &all, i));
            }
            stats
        });
        if self.center != DVec3::ZERO {
            let seen = out.positions.iter_mut().zip(&out.objects).filter(|p| *p.1 > 0);
            seen.for_each(|(p, _)| *p = (self.center + p.as_dvec3()).as_vec3());
        }
        stats
    }
}

/// The materials with cut-offs instead of blending; `None` where nothing blends.
fn solid(materials: &[Material]) -> Option<Vec<Material>> {
    let cut = |m: &Material| match m.alpha {
        AlphaMode::Blend => Material { alpha: AlphaMode::Mask(VISIBLE), ..m.clone() },
        _ => m.clone(),
    };
    materials.iter().any(|m| m.alpha == AlphaMode::Blend).then(|| materials.iter().map(cut).collect())
}

/// The bone, from 1, that each vertex follows most, or that all follow.
fn labels(character: &Character, instance: &Instance) -> Vec<u32> {
    match &instance.binding {
        Binding::Bone(b) => vec![b.0 + 1],
        Binding::Skin { palette, weights } => {
            let vertices = 0..character.mesh(instance).positions.len();
            vertices.map(|v| weights.of(v).next().map_or(0, |(b, _)| palette[b].0.0 + 1)).collect()
        }
    }
}
