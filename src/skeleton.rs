//! The tree of bones: described in any order, checked once, then immutable.
//!
//! Everything that moves is a bone. A bone's frame is fixed to it; its rest transform `parent_from_bone` says where that
//! frame stands in its parent's when nothing is posed. XZX angles turn the bone about its *aim* frame, whose +x runs along
//! the bone: our own rigs are built so that both frames are one, an importer computes the aim from the children.

use crate::math::Trs;
use glam::{Affine3A, Quat, Vec3};

/// A bone's place in the skeleton, parents before children.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BoneId(pub u32);

impl BoneId {
    /// The place as an array index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Bounds on XZX angles in radians, used by solvers and editors; animation is free of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Smallest (θ₁, θ₂, θ₃).
    pub min: Vec3,
    /// Largest (θ₁, θ₂, θ₃).
    pub max: Vec3,
}

/// What a caller says of one bone.
#[derive(Clone, Debug, PartialEq)]
pub struct BoneDesc {
    /// For people and files; need not be unique.
    pub name: String,
    /// The parent's place in the list of descriptions; `None` for a root.
    pub parent: Option<usize>,
    /// `parent_from_bone` at rest.
    pub rest: Trs,
    /// `parent_from_bone` where no translation, rotation and scale can express it (shear); such a bone never moves
    /// against its parent.
    pub fixed: Option<Affine3A>,
    /// Metres from the bone's origin to its tip along the aim's +x.
    pub length: f32,
    /// `bone_from_aim`: the frame whose +x runs along the bone.
    pub aim: Quat,
    /// Angle limits, if it has any.
    pub limits: Option<Limits>,
}

impl BoneDesc {
    /// A root bone at the origin, of length 0, aimed along its own x axis.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            parent: None,
            rest: Trs::IDENTITY,
            fixed: None,
            length: 0.0,
            aim: Quat::IDENTITY,
            limits: None,
        }
    }
}

/// Bones in depth-first order, so that parents precede children and every subtree is one run.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Skeleton {
    bones: Vec<BoneDesc>,
    parents: Vec<Option<BoneId>>,
    subtree: Vec<u32>,
}

/// Why a list of bones is no tree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SkeletonError {
    /// A parent index beyond the list.
    #[error("bone {bone} `{name}`: parent {parent} does not exist; there are {count} bones")]
    ParentOutOfRange {
        /// The bone's place in the list.
        bone: usize,
        /// Its name.
        name: String,
        /// The parent that it asks for.
        parent: usize,
        /// Length of the list.
        count: usize,
    },
    /// Bones that are their own ancestors.
    #[error("bone {bone} `{name}` is its own ancestor; remove the cycle")]
    Cycle {
        /// A bone on the cycle, by its place in the list.
        bone: usize,
        /// Its name.
        name: String,
    },
    /// A rest transform, length or limit with NaN or infinity.
    #[error("bone {bone} `{name}`: its {what} is not finite")]
    NotFinite {
        /// The bone's place in the list.
        bone: usize,
        /// Its name.
        name: String,
        /// Which of its properties.
        what: &'static str,
    },
}

impl Skeleton {
    /// Sort, check and freeze. Returns the skeleton, and for each description the bone it became.
    ///
    /// Order among siblings is the order of the list. Works for chains of any depth (no recursion).
    ///
    /// ```
    /// use sinew::skeleton::{BoneDesc, Skeleton};
    /// let child = BoneDesc { parent: Some(1), ..BoneDesc::new("hand") };
    /// let (skeleton, of) = Skeleton::new(vec![child, BoneDesc::new("arm")]).unwrap();
    /// assert_eq!(skeleton.name(of[0]), "hand");
    /// assert_eq!(skeleton.parent(of[0]), Some(of[1]));
    /// ```
    ///
    /// # Errors
    /// [`SkeletonError`]: a parent out of range, a cycle, or a number that is not finite.
    pub fn new(descs: Vec<BoneDesc>) -> Result<(Self, Vec<BoneId>), SkeletonError> {
        let n = descs.len();
        for (bone, d) in descs.iter().enumerate() {
            check(bone, d, n)?;
        }

        // Link children, so that one stack walk visits each subtree in one run.
        let mut first_child = vec![usize::MAX; n + 1];
        let mut next_sibling = vec![usize::MAX; n];
        for bone in (0..n).rev() {
            let slot = descs[bone].parent.unwrap_or(n);
            next_sibling[bone] = first_child[slot];
            first_child[slot] = bone;
        }
        let mut order = Vec::with_capacity(n);
        let mut stack = Vec::new();
        let push_children = |of: usize, stack: &mut Vec<usize>| {
            let start = stack.len();
            let mut c = first_child[of];
            while c != usize::MAX {
                stack.push(c);
                c = next_sibling[c];
            }
            stack[start..].reverse();
        };
        push_children(n, &mut stack);
        while let Some(bone) = stack.pop() {
            order.push(bone);
            push_children(bone, &mut stack);
        }

        // Whoever was not reached from a root hangs on a cycle.
        let mut of = vec![BoneId(u32::MAX); n];
        for (place, &bone) in order.iter().enumerate() {
            of[bone] = BoneId(place as u32);
        }
        if let Some(bone) = of.iter().position(|b| b.0 == u32::MAX) {
            return Err(SkeletonError::Cycle { bone, name: descs[bone].name.clone() });
        }

        // Sizes of subtrees, children first.
        let mut slots: Vec<Option<BoneDesc>> = descs.into_iter().map(Some).collect();
        let bones: Vec<BoneDesc> = order.iter().filter_map(|&b| slots[b].take()).collect();
        let parents: Vec<Option<BoneId>> = bones.iter().map(|b| b.parent.map(|p| of[p])).collect();
        let mut subtree = vec![1u32; n];
        for i in (0..n).rev() {
            if let Some(p) = parents[i] {
                subtree[p.index()] += subtree[i];
            }
        }
        Ok((Self { bones, parents, subtree }, of))
    }

    /// Number of bones, `B`.
    pub fn len(&self) -> usize {
        self.bones.len()
    }

    /// There are no bones.
    pub fn is_empty(&self) -> bool {
        self.bones.is_empty()
    }

    /// All bones, parents first.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = BoneId> + DoubleEndedIterator + use<> {
        (0..self.bones.len() as u32).map(BoneId)
    }

    /// The bone's name.
    pub fn name(&self, bone: BoneId) -> &str {
        &self.bones[bone.index()].name
    }

    /// The first bone of that name.
    pub fn find(&self, name: &str) -> Option<BoneId> {
        self.bones.iter().position(|b| b.name == name).map(|i| BoneId(i as u32))
    }

    /// The parent; `None` for a root.
    #[inline]
    pub fn parent(&self, bone: BoneId) -> Option<BoneId> {
        self.parents[bone.index()]
    }

    /// `parent_from_bone` at rest.
    #[inline]
    pub fn rest(&self, bone: BoneId) -> &Trs {
        &self.bones[bone.index()].rest
    }

    /// `parent_from_bone` of a bone that never moves against its parent.
    #[inline]
    pub fn fixed(&self, bone: BoneId) -> Option<&Affine3A> {
        self.bones[bone.index()].fixed.as_ref()
    }

    /// `bone_from_aim`: +x of the aim frame runs along the bone.
    pub fn aim(&self, bone: BoneId) -> Quat {
        self.bones[bone.index()].aim
    }

    /// Metres from origin to tip.
    pub fn length(&self, bone: BoneId) -> f32 {
        self.bones[bone.index()].length
    }

    /// Tip of the bone in its own frame: `length` along the aim's +x.
    pub fn tip(&self, bone: BoneId) -> Vec3 {
        let b = &self.bones[bone.index()];
        b.aim * Vec3::new(b.length, 0.0, 0.0)
    }

    /// Angle limits.
    pub fn limits(&self, bone: BoneId) -> Option<Limits> {
        self.bones[bone.index()].limits
    }

    /// What was said of the bone, its parent by its place in this skeleton: the list of all bones makes it again.
    pub fn desc(&self, bone: BoneId) -> BoneDesc {
        BoneDesc { parent: self.parent(bone).map(BoneId::index), ..self.bones[bone.index()].clone() }
    }

    /// The bone and all below it, as a range of places.
    pub fn subtree(&self, bone: BoneId) -> std::ops::Range<usize> {
        bone.index()..bone.index() + self.subtree[bone.index()] as usize
    }
}

fn check(bone: usize, d: &BoneDesc, count: usize) -> Result<(), SkeletonError> {
    let name = || d.name.clone();
    if let Some(parent) = d.parent.filter(|&p| p >= count) {
        return Err(SkeletonError::ParentOutOfRange { bone, name: name(), parent, count });
    }
    let limits_ok = d.limits.is_none_or(|l| !l.min.is_nan() && !l.max.is_nan());
    let what = if !d.rest.is_finite() || d.fixed.is_some_and(|m| !m.is_finite()) {
        "rest transform"
    } else if !d.length.is_finite() || !d.aim.is_finite() {
        "length or aim"
    } else if !limits_ok {
        "limit"
    } else {
        return Ok(());
    };
    Err(SkeletonError::NotFinite { bone, name: name(), what })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bone(parent: Option<usize>) -> BoneDesc {
        BoneDesc { parent, ..BoneDesc::new(format!("child of {parent:?}")) }
    }

    #[test]
    fn subtrees_are_runs() {
        //  3 ── 0 ── 4      1 ── 2
        //   └── 5
        let list = vec![bone(Some(3)), bone(None), bone(Some(1)), bone(None), bone(Some(0)), bone(Some(3))];
        let (s, of) = Skeleton::new(list).unwrap();
        assert_eq!(of.iter().map(|b| b.0).collect::<Vec<_>>(), [3, 0, 1, 2, 4, 5]);
        assert_eq!(s.subtree(of[3]), 2..6);
        assert_eq!(s.subtree(of[0]), 3..5);
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let e = Skeleton::new(vec![bone(Some(1)), bone(Some(0)), bone(None)]).unwrap_err();
        assert!(matches!(e, SkeletonError::Cycle { bone: 0, .. }));
        let e = Skeleton::new(vec![bone(Some(7))]).unwrap_err();
        assert!(e.to_string().contains("parent 7 does not exist"), "{e}");
        let mut bad = bone(None);
        bad.rest.translation.y = f32::NAN;
        assert!(matches!(Skeleton::new(vec![bad]), Err(SkeletonError::NotFinite { .. })));
    }

    #[test]
    fn a_hundred_thousand_bones_in_a_chain() {
        let n = 100_000;
        let (s, _) = Skeleton::new((0..n).map(|i: usize| bone(i.checked_sub(1))).collect()).unwrap();
        assert_eq!(s.subtree(BoneId(0)), 0..n);
    }
}
