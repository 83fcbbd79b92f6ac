//! What a pixel shows, beside its colour.

use glam::{Vec2, Vec3};

/// One thing that can be told of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Channel {
    /// Which object: [`Channels::objects`].
    Object,
    /// Which of its parts, by [`Object::labels`](crate::scene::Object::labels): [`Channels::labels`].
    Label,
    /// How far away: [`Channels::depth`].
    Depth,
    /// Which way the surface looks: [`Channels::normals`].
    Normal,
    /// Where it is: [`Channels::positions`].
    Position,
    /// Texture coordinates: [`Channels::uvs`].
    Uv,
}

impl Channel {
    /// Every channel.
    pub const ALL: [Self; 6] =
        [Self::Object, Self::Label, Self::Depth, Self::Normal, Self::Position, Self::Uv];
}

/// What is seen in each pixel, row by row from the top left.
///
/// A pixel has a surface exactly where a picture with the same settings is covered by something that does not blend, be it
/// by one of its samples. Where several objects share a pixel, the one with most samples has it, the nearest of equals; depth and
/// normal are then that object's alone, so no value lies between two objects. Label, position and texture coordinates are those of the
/// one triangle that has most of the object's samples there (the first of equals), at the middle of these: they do not mix.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Channels {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Index of the object plus one; 0 where nothing is. Always there.
    pub objects: Vec<u32>,
    /// Distance of the nearest sample along the view direction, metres; infinite where nothing is. Empty unless asked for.
    pub depth: Vec<f32>,
    /// Mean unit shading normals, normal maps included, in view space: +x right, +y up, +z towards the viewer; zero where nothing
    /// is. Empty unless asked for.
    pub normals: Vec<Vec3>,
    /// Label of the triangle's corner that is nearest in barycentric coordinates; 0 where nothing is or nothing is labelled. Empty
    /// unless asked for.
    pub labels: Vec<u32>,
    /// Scene space, metres; zero where nothing is. Empty unless asked for.
    pub positions: Vec<Vec3>,
    /// The mesh's first set; zero where nothing is or the mesh has none. Empty unless asked for.
    pub uvs: Vec<Vec2>,
}

/// Object, triangle and depth of each pixel's centre, row by row from the top left.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct IdImage {
    /// Pixels a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Index of the object plus one; 0 where nothing is.
    pub objects: Vec<u32>,
    /// Index of the triangle in its mesh; 0 where nothing is.
    pub triangles: Vec<u32>,
    /// Distance along the view direction, metres; infinite where nothing is.
    pub depth: Vec<f32>,
}

impl Channels {
    /// Take the size of a picture, and hold what is asked for; all pixels are empty.
    pub fn reset(&mut self, width: usize, height: usize, wanted: &[Channel]) {
        let n = width * height;
        let planes = |c: Channel| if wanted.contains(&c) { n } else { 0 };
        (self.width, self.height) = (width, height);
        refill(&mut self.objects, n, 0);
        refill(&mut self.depth, planes(Channel::Depth), f32::INFINITY);
        refill(&mut self.normals, planes(Channel::Normal), Vec3::ZERO);
        refill(&mut self.labels, planes(Channel::Label), 0);
        refill(&mut self.positions, planes(Channel::Position), Vec3::ZERO);
        refill(&mut self.uvs, planes(Channel::Uv), Vec2::ZERO);
    }

    /// Let pixel `to` show what pixel `from` of channels of the same size and kind shows.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn copy_pixel(&mut self, to: usize, other: &Self, from: usize) {
        copy(&mut self.objects, &other.objects, to, from);
        copy(&mut self.depth, &other.depth, to, from);
        copy(&mut self.normals, &other.normals, to, from);
        copy(&mut self.labels, &other.labels, to, from);
        copy(&mut self.positions, &other.positions, to, from);
        copy(&mut self.uvs, &other.uvs, to, from);
    }
}

fn copy<T: Copy>(list: &mut [T], other: &[T], to: usize, from: usize) {
    if !list.is_empty() {
        list[to] = other[from];
    }
}

fn refill<T: Clone>(list: &mut Vec<T>, n: usize, value: T) {
    list.clear();
    list.resize(n, value);
}
