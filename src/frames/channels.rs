//! What the pixels of a moment show, beside their colour.

use super::{FrameStats, Moment, Shot, Worker};
use crate::render::channel::{Channel, Channels};
use crate::scene::{AlphaMode, Material, Scene};

/// Half an 8-bit step: whatever blends with more than that is visible.
const VISIBLE: f32 = 0.5 / 255.0;

impl Shot<'_> {
    /// Objects, distances and normals of a moment, with the samples that the shot's pictures have.
    ///
    /// Objects are the character's mesh instances, in order. A surface that blends counts where nothing lies behind it: then it is what
    /// the pixel shows, so that wherever a picture of the character has alpha there is a surface.
    pub fn draw_channels(
        &self,
        moment: impl Into<Moment>,
        worker: &mut Worker,
        wanted: &[Channel],
        out: &mut Channels,
    ) -> FrameStats {
        let settings = &self.desc.settings;
        let solid = solid(&self.materials);
        self.with_scene(moment.into(), worker, |scene, rasterizer| {
            let stats = rasterizer.draw_channels(scene, settings, wanted, out);
            if let Some(materials) = &solid {
                let mut all = Channels::default();
                let scene = Scene { materials, ..scene.clone() };
                rasterizer.draw_channels(&scene, settings, wanted, &mut all);
                let empty = (0..all.objects.len()).filter(|&i| out.objects[i] == 0).collect::<Vec<_>>();
                empty.into_iter().for_each(|i| out.copy_pixel(i, &all, i));
            }
            stats
        })
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
