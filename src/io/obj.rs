//! Wavefront objects (OBJ), written: points, texture coordinates, normals, and groups by material.

use super::still::{Still, area, material_name};
use crate::asset::Asset;
use glam::{Vec2, Vec3};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Write a still as OBJ; `library` names the file of its materials, if there is one. Numbers are the shortest that read back as they were.
///
/// ```
/// use sinew::asset::Asset;
/// use sinew::io::{obj, still::{Still, Surface}};
/// use glam::Vec3;
/// let surface = Surface { point: vec![0, 1, 2], triangles: vec![[0, 1, 2]], ..Surface::default() };
/// let still = Still { points: vec![Vec3::ZERO, Vec3::X, Vec3::Y], surfaces: vec![surface] };
/// assert!(obj::write(&still, &Asset::default(), None).ends_with("v 0 1 0\no surface_0\nf 1 2 3\n"));
/// ```
pub fn write(still: &Still, asset: &Asset, library: Option<&str>) -> String {
    let mut out = String::from("# metres, y up\n");
    let mut line = |l: std::fmt::Arguments| {
        out.write_fmt(l).and_then(|()| out.write_char('\n')).expect("a string takes anything");
    };
    if let Some(library) = library {
        line(format_args!("mtllib {library}"));
    }
    still.points.iter().for_each(|p| line(format_args!("v {} {} {}", p.x, p.y, p.z)));
    let (mut uvs, mut normals) = (BTreeMap::new(), BTreeMap::new());
    for s in &still.surfaces {
        // Two vertices that say the same share a line.
        let uv = |uv: &Vec2| {
            let next = uvs.len() + 1;
            *uvs.entry(uv.to_array().map(f32::to_bits)).or_insert_with(|| {
                line(format_args!("vt {} {}", uv.x, 1.0 - uv.y));
                next
            })
        };
        let uv: Vec<usize> = s.uvs.iter().map(uv).collect();
        let normal = |n: &Vec3| {
            let next = normals.len() + 1;
            *normals.entry(n.to_array().map(f32::to_bits)).or_insert_with(|| {
                line(format_args!("vn {} {} {}", n.x, n.y, n.z));
                next
            })
        };
        let normal: Vec<usize> = s.normals.iter().map(normal).collect();
        let name: String = s.name.chars().map(|c| if c.is_whitespace() { '_' } else { c }).collect();
        let index = still.surfaces.iter().position(|o| std::ptr::eq(o, s)).unwrap_or(0);
        line(format_args!("o {}_{index}", if name.is_empty() { "surface" } else { &name }));
        if let (Some(id), Some(_)) = (s.material, library) {
            line(format_args!("usemtl {}", material_name(asset, id)));
        }
        let corner = |v: usize| {
            let p = s.point[v] + 1;
            match (uv.get(v), normal.get(v)) {
                (Some(t), Some(n)) => format!("{p}/{t}/{n}"),
                (Some(t), None) => format!("{p}/{t}"),
                (None, Some(n)) => format!("{p}//{n}"),
                (None, None) => p.to_string(),
            }
        };
        for t in s.triangles.iter().filter(|t| area(&t.map(|v| s.point[v as usize]))) {
            let [a, b, c] = t.map(|v| corner(v as usize));
            line(format_args!("f {a} {b} {c}"));
        }
    }
    out
}

/// The materials of an asset (MTL): diffuse colour and opacity.
pub fn materials(asset: &Asset) -> String {
    let mut out = String::new();
    for (i, m) in asset.materials.iter().enumerate() {
        let (name, d) = (material_name(asset, crate::mesh::MaterialId(i as u32)), m.diffuse);
        write!(out, "newmtl {name}\nKd {} {} {}\nd {}\nillum 2\n\n", d.x, d.y, d.z, d.w)
            .expect("a string takes anything");
    }
    out
}
