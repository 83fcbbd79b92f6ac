//! What a pixel shows, beside its colour.

use glam::Vec3;

/// One thing that can be told of a pixel.
///
/// More may come: bones, positions, texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Channel {
    /// Which object: [`Channels::objects`].
    Object,
    /// How far away: [`Channels::depth`].
    Depth,
    /// Which way the surface looks: [`Channels::normals`].
    Normal,
}

impl Channel {
    /// Every channel.
    pub const ALL: [Self; 3] = [Self::Object, Self::Depth, Self::Normal];
}

/// What is seen in each pixel, row by row from the top left.
///
/// A pixel has a surface exactly where a picture with the same settings is covered by something that does not blend, be it
/// by one of its samples. Where several objects share a pixel, the one with most samples has it, the nearest of equals; depth and
/// normal are then that object's alone, so no value lies between two objects.
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
    }

    /// Let pixel `to` show what pixel `from` of channels of the same size and kind shows.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn copy_pixel(&mut self, to: usize, other: &Self, from: usize) {
        self.objects[to] = other.objects[from];
        if !self.depth.is_empty() {
            self.depth[to] = other.depth[from];
        }
        if !self.normals.is_empty() {
            self.normals[to] = other.normals[from];
        }
    }
}

fn refill<T: Clone>(list: &mut Vec<T>, n: usize, value: T) {
    list.clear();
    list.resize(n, value);
}
