//! A character: skeleton, meshes, what binds them, and clips, cross-checked once.

mod symmetry;

use crate::clip::{Clip, Target};
use crate::fk::{self, Posed};
use crate::mesh::Mesh;
use crate::morph::{self, Morphed};
use crate::pose::Pose;
use crate::skeleton::{BoneId, Skeleton};
use crate::skin::{self, Deformed, Method, Rest, Weights};
use glam::{Affine3A, DAffine3, DVec3, Vec3};

/// A mesh's place in the character.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MeshId(pub u32);

/// What drives a mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum Binding {
    /// The mesh is fixed to a bone and given in its frame.
    Bone(BoneId),
    /// Linear blend over a skin's bones.
    Skin {
        /// Palette: bone and `bone_from_mesh` (the inverse bind matrix), in the order that weights index.
        palette: Vec<(BoneId, Affine3A)>,
        /// Influences of every vertex.
        weights: Weights,
    },
}

/// A mesh in the scene; several may share one mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Which mesh.
    pub mesh: MeshId,
    /// What drives it.
    pub binding: Binding,
    /// Its run in `Pose::weights`: first weight; as long as the mesh has targets.
    pub first_weight: usize,
}

/// Everything that is animated, and nothing of how it looks.
#[derive(Clone, Debug, Default)]
pub struct Character {
    skeleton: Skeleton,
    meshes: Vec<Mesh>,
    instances: Vec<Instance>,
    rest_weights: Vec<f32>,
    clips: Vec<Clip>,
}

/// Parts that do not belong together.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CharacterError {
    /// A mesh instance that names something missing.
    #[error("mesh instance {instance}: {what} {index} does not exist; there are {count}")]
    Instance {
        /// Which instance.
        instance: usize,
        /// Mesh, bone, palette entry or morph weight.
        what: &'static str,
        /// The index asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// Weights for another number of vertices.
    #[error("mesh instance {instance}: weights for {found} vertices, the mesh has {expected}")]
    Weights {
        /// Which instance.
        instance: usize,
        /// Vertices that the weights cover.
        found: usize,
        /// Vertices of the mesh.
        expected: usize,
    },
    /// A track that moves something missing, or has the wrong width.
    #[error("clip {clip} `{name}`, track {track}: {why}")]
    Track {
        /// Which clip.
        clip: usize,
        /// Its name.
        name: String,
        /// Which track.
        track: usize,
        /// What is wrong.
        why: String,
    },
}

impl Character {
    /// Put the parts together and check that every reference between them holds.
    ///
    /// `rest_weights` are the morph weights at rest, one run an instance as `first_weight` says.
    ///
    /// # Errors
    /// [`CharacterError`] names the first reference that does not hold.
    pub fn new(
        skeleton: Skeleton,
        meshes: Vec<Mesh>,
        instances: Vec<Instance>,
        rest_weights: Vec<f32>,
        clips: Vec<Clip>,
    ) -> Result<Self, CharacterError> {
        let c = Self { skeleton, meshes, instances, rest_weights, clips };
        for i in 0..c.instances.len() {
            c.check_instance(i)?;
        }
        for (i, clip) in c.clips.iter().enumerate() {
            c.check_clip(i, clip)?;
        }
        Ok(c)
    }

    fn check_instance(&self, instance: usize) -> Result<(), CharacterError> {
        let inst = &self.instances[instance];
        let within = |what, index: usize, count: usize| {
            if index < count {
                return Ok(());
            }
            Err(CharacterError::Instance { instance, what, index, count })
        };
        within("mesh", inst.mesh.0 as usize, self.meshes.len())?;
        let mesh = &self.meshes[inst.mesh.0 as usize];
        within("morph weight", inst.first_weight + mesh.targets.len(), self.rest_weights.len() + 1)?;
        match &inst.binding {
            Binding::Bone(b) => within("bone", b.index(), self.skeleton.len()),
            Binding::Skin { palette, weights } => {
                for (b, _) in palette {
                    within("bone", b.index(), self.skeleton.len())?;
                }
                let (found, expected) = (weights.vertex_count(), mesh.positions.len());
                if found != expected {
                    return Err(CharacterError::Weights { instance, found, expected });
                }
                let top = (0..found).flat_map(|v| weights.of(v)).map(|(b, _)| b).max().unwrap_or(0);
                within("palette entry", top, palette.len().max(usize::from(found == 0)))
            }
        }
    }

    fn check_clip(&self, clip: usize, of: &Clip) -> Result<(), CharacterError> {
        for (track, t) in of.tracks.iter().enumerate() {
            let width = t.curve.width();
            let (ok, why) = match t.target {
                Target::Weights { first } => (
                    first + width <= self.rest_weights.len(),
                    format!("morph weights {first}…{} of {}", first + width, self.rest_weights.len()),
                ),
                Target::Xzx(b) | Target::Translation(b) | Target::Scale(b) => (
                    b.index() < self.skeleton.len() && width == 3,
                    format!("bone {} of {}, width {width} where 3 is needed", b.0, self.skeleton.len()),
                ),
                Target::Rotation(b) => (
                    b.index() < self.skeleton.len() && width == 4,
                    format!("bone {} of {}, width {width} where 4 is needed", b.0, self.skeleton.len()),
                ),
            };
            if !ok {
                return Err(CharacterError::Track { clip, name: of.name.clone(), track, why });
            }
        }
        Ok(())
    }

    /// The tree of bones.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// All meshes.
    pub fn meshes(&self) -> &[Mesh] {
        &self.meshes
    }

    /// The mesh of an instance.
    pub fn mesh(&self, instance: &Instance) -> &Mesh {
        &self.meshes[instance.mesh.0 as usize]
    }

    /// What is drawn: meshes and their bindings.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// Animations.
    pub fn clips(&self) -> &[Clip] {
        &self.clips
    }

    /// The same character with other clips.
    ///
    /// # Errors
    /// [`CharacterError::Track`] if a clip does not fit.
    pub fn with_clips(mut self, clips: Vec<Clip>) -> Result<Self, CharacterError> {
        for (i, clip) in clips.iter().enumerate() {
            self.check_clip(i, clip)?;
        }
        self.clips = clips;
        Ok(self)
    }

    /// The same character with at most `k` influences a vertex: the largest, scaled to sum 1.
    ///
    /// # Panics
    /// If `k` is 0.
    pub fn with_influences(&self, k: usize) -> Self {
        let mut out = self.clone();
        for i in &mut out.instances {
            if let Binding::Skin { weights, .. } = &mut i.binding {
                *weights = weights.strongest(k);
            }
        }
        out
    }

    /// The bones that move a vertex of an instance.
    ///
    /// # Panics
    /// If there is no such instance or vertex.
    pub fn bones_of(&self, instance: usize, vertex: usize) -> impl Iterator<Item = BoneId> + '_ {
        let (one, many) = match &self.instances[instance].binding {
            Binding::Bone(b) => (Some(*b), None),
            Binding::Skin { palette, weights } => (None, Some((palette, weights))),
        };
        let skinned =
            many.into_iter().flat_map(move |(p, w)| w.of(vertex).map(|(b, weight)| (p[b].0, weight)));
        one.into_iter().chain(skinned.filter(|s| s.1 > 0.0).map(|s| s.0))
    }

    /// Runs of morph weights, each of one mesh instance or of several that move together: the first weight, and how many.
    pub fn weight_runs(&self) -> Vec<(usize, usize)> {
        let width = |i: &Instance| self.mesh(i).targets.len();
        let mut runs: Vec<(usize, usize)> =
            self.instances.iter().filter(|i| width(i) > 0).map(|i| (i.first_weight, width(i))).collect();
        runs.sort_unstable();
        runs.dedup();
        runs
    }

    /// The bone that moves a vertex of an instance most; `None` where none does.
    ///
    /// # Panics
    /// If there is no such instance or vertex.
    pub fn main_bone(&self, instance: usize, vertex: usize) -> Option<BoneId> {
        match &self.instances[instance].binding {
            Binding::Bone(b) => Some(*b),
            Binding::Skin { palette, weights } => {
                let most = weights.of(vertex).max_by(|a, b| a.1.total_cmp(&b.1));
                most.filter(|m| m.1 > 0.0).map(|m| palette[m.0].0)
            }
        }
    }

    /// For each morph weight, how far it moves a vertex at most, metres in the mesh's frame.
    pub fn target_reach(&self) -> Vec<f64> {
        let mut reach = vec![0.0_f64; self.rest_weights.len()];
        for i in &self.instances {
            for (k, target) in self.mesh(i).targets.iter().enumerate() {
                let far = target.positions.iter().map(|d| d.length() as f64).fold(0.0, f64::max);
                let r = &mut reach[i.first_weight + k];
                *r = r.max(far);
            }
        }
        reach
    }

    /// The pose that no clip touches.
    pub fn rest_pose(&self) -> Pose {
        Pose { weights: self.rest_weights.clone(), ..Pose::rest(&self.skeleton) }
    }

    /// The pose of clip `clip` (rest for `None`) at `t` seconds; a time outside holds the ends.
    ///
    /// # Panics
    /// If there is no such clip.
    pub fn pose(&self, clip: Option<usize>, t: f64) -> Pose {
        let mut pose = self.rest_pose();
        if let Some(c) = clip {
            self.clips[c].sample(&self.skeleton, t, &mut pose);
        }
        pose
    }

    /// Bones of a pose in the world.
    pub fn posed(&self, pose: &Pose) -> Posed {
        let mut posed = Posed::default();
        fk::forward(&self.skeleton, pose, &mut posed);
        posed
    }

    /// A centre to deform around: near what is drawn, so that f32 suffices (see [`Posed::near`]).
    pub fn center(&self, posed: &Posed) -> DVec3 {
        let first = self.instances.first().and_then(|i| match &i.binding {
            Binding::Bone(b) => Some(*b),
            Binding::Skin { palette, .. } => palette.first().map(|(b, _)| *b),
        });
        first.or_else(|| self.skeleton.ids().next()).map_or(DVec3::ZERO, |b| posed.origin(b))
    }

    /// Deform one instance: positions relative to `center`, along the world's axes.
    ///
    /// # Panics
    /// If `instance`, `pose` or `posed` are not of this character.
    pub fn deform(
        &self,
        instance: usize,
        pose: &Pose,
        posed: &Posed,
        center: DVec3,
        scratch: &mut Scratch,
        out: &mut Deformed,
    ) {
        let Scratch { morphed, palette, .. } = scratch;
        let rest = self.morph(instance, pose, morphed);
        let method = self.palette(instance, posed, center, palette);
        skin::deform(method, rest, palette, out);
    }

    /// The same, if its matrices or its morph weights are not those that `last` remembers: what does not move is not
    /// computed again. `last` and `out` belong to this instance alone. Returns whether anything was computed.
    ///
    /// # Panics
    /// If `instance`, `pose` or `posed` are not of this character.
    pub fn deform_if_moved(
        &self,
        instance: usize,
        pose: &Pose,
        posed: &Posed,
        center: DVec3,
        scratch: &mut Scratch,
        last: &mut LastDeform,
        out: &mut Deformed,
    ) -> bool {
        let Scratch { morphed, palette } = scratch;
        let inst = &self.instances[instance];
        let weights = &pose.weights[inst.first_weight..][..self.mesh(inst).targets.len()];
        let method = self.palette(instance, posed, center, palette);
        if last.known && last.palette == *palette && last.weights == weights {
            return false;
        }
        last.known = true;
        last.palette.clone_from(palette);
        last.weights.clear();
        last.weights.extend_from_slice(weights);
        skin::deform(method, self.morph(instance, pose, morphed), palette, out);
        true
    }

    /// Positions alone, as [`deform`](Self::deform) gives them.
    ///
    /// # Panics
    /// If `instance`, `pose` or `posed` are not of this character.
    pub fn positions(
        &self,
        instance: usize,
        pose: &Pose,
        posed: &Posed,
        center: DVec3,
        scratch: &mut Scratch,
        out: &mut Vec<Vec3>,
    ) {
        let Scratch { morphed, palette } = scratch;
        let rest = self.morph(instance, pose, morphed);
        let method = self.palette(instance, posed, center, palette);
        skin::deform_positions(method, rest.positions, palette, out);
    }

    /// World positions of an instance, all in f64: the slow reference for [`positions`](Self::positions). `bones` are
    /// `world_from_bone` as [`fk::forward_f64`] gives them.
    ///
    /// # Panics
    /// If `instance`, `pose` or `bones` are not of this character.
    pub fn positions_f64(&self, instance: usize, pose: &Pose, bones: &[DAffine3]) -> Vec<DVec3> {
        let inst = &self.instances[instance];
        let mesh = self.mesh(inst);
        let rest = morph::positions_f64(mesh, &pose.weights[inst.first_weight..][..mesh.targets.len()]);
        match &inst.binding {
            Binding::Bone(b) => skin::deform_f64(Method::Rigid(0), &rest, &[bones[b.index()]]),
            Binding::Skin { palette, weights } => {
                let wide = palette.iter().map(|(b, m)| bones[b.index()] * fk::widen(m));
                skin::deform_f64(Method::Linear(weights), &rest, &wide.collect::<Vec<_>>())
            }
        }
    }

    fn morph<'s>(&'s self, instance: usize, pose: &Pose, morphed: &'s mut Morphed) -> Rest<'s> {
        let inst = &self.instances[instance];
        let mesh = self.mesh(inst);
        morphed.apply(mesh, &pose.weights[inst.first_weight..][..mesh.targets.len()])
    }

    /// `local_from_mesh` of every bone that drives the instance, and how they drive it.
    fn palette(
        &self,
        instance: usize,
        posed: &Posed,
        center: DVec3,
        palette: &mut Vec<Affine3A>,
    ) -> Method<'_> {
        palette.clear();
        match &self.instances[instance].binding {
            Binding::Bone(b) => {
                palette.push(posed.near(*b, center));
                Method::Rigid(0)
            }
            Binding::Skin { palette: bones, weights } => {
                palette.extend(bones.iter().map(|(b, m)| posed.near(*b, center) * *m));
                Method::Linear(weights)
            }
        }
    }
}

/// Buffers that [`Character::deform`] uses again.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    morphed: Morphed,
    palette: Vec<Affine3A>,
}

/// What an instance was last deformed by; nothing at first.
#[derive(Clone, Debug, Default)]
pub struct LastDeform {
    known: bool,
    palette: Vec<Affine3A>,
    weights: Vec<f32>,
}
