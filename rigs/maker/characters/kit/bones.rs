//! Skeletons by heads and tails in rest space.

use super::{point, round};
use glam::{DMat3, DQuat, DVec3};
use sinew::io::rig_json::Bone;

/// Bones in the order in which they were added, parents first.
#[derive(Default)]
pub struct Bones {
    pub list: Vec<Bone>,
    pub parents: Vec<Option<usize>>,
    pub heads: Vec<DVec3>,
    pub tails: Vec<DVec3>,
    /// `world_from_bone` at rest.
    pub frames: Vec<DQuat>,
}

impl Bones {
    /// Add a bone that bends about its default hinge.
    pub fn add(&mut self, name: &str, parent: Option<&str>, head: [f64; 3], tail: [f64; 3]) -> &mut Bone {
        self.push(name, parent, head.into(), tail.into(), None)
    }

    /// Add a bone and the axis of its bend.
    pub fn hinged(
        &mut self,
        name: &str,
        parent: &str,
        head: [f64; 3],
        tail: [f64; 3],
        hinge: DVec3,
    ) -> &mut Bone {
        self.push(name, Some(parent), head.into(), tail.into(), Some(hinge))
    }

    fn push(
        &mut self,
        name: &str,
        parent: Option<&str>,
        head: DVec3,
        tail: DVec3,
        hinge: Option<DVec3>,
    ) -> &mut Bone {
        let place = |p: DVec3| DVec3::from_array(p.to_array().map(|x| round(x, 4)));
        let (head, tail) = (place(head), place(tail));
        let hinge = hinge.map(place);
        self.parents.push(parent.map(|p| self.id(p)));
        self.heads.push(head);
        self.tails.push(tail);
        self.frames.push(frame(head, tail, hinge));
        self.list.push(Bone {
            name: name.into(),
            parent: parent.map(Into::into),
            head: Some(point(head)),
            tail: Some(point(tail)),
            hinge: hinge.map(point),
            ..Default::default()
        });
        let last = self.list.len() - 1;
        &mut self.list[last]
    }

    /// The place of a bone.
    pub fn id(&self, name: &str) -> usize {
        match self.list.iter().position(|b| b.name == name) {
            Some(i) => i,
            None => panic!("no bone `{name}`"),
        }
    }

    /// Where the bone begins.
    pub fn head(&self, name: &str) -> DVec3 {
        self.heads[self.id(name)]
    }

    /// Where it ends.
    pub fn tail(&self, name: &str) -> DVec3 {
        self.tails[self.id(name)]
    }

    /// A point of rest space in the bone's frame.
    pub fn to_local(&self, bone: usize, p: DVec3) -> DVec3 {
        self.frames[bone].conjugate() * (p - self.heads[bone])
    }
}

/// The frame that the format gives to a bone.
fn frame(head: DVec3, tail: DVec3, hinge: Option<DVec3>) -> DQuat {
    let x = (tail - head).normalize();
    let hinge = hinge.unwrap_or(if x.x.abs() > 0.8 { DVec3::Y } else { DVec3::X });
    let z = (hinge - x * x.dot(hinge)).normalize();
    DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)).normalize()
}

/// Limits of a bone: smallest and largest twist, bend, twist in degrees.
pub fn limit(bone: &mut Bone, min: [f64; 3], max: [f64; 3]) {
    bone.min_deg = Some(min.map(Some));
    bone.max_deg = Some(max.map(Some));
}
