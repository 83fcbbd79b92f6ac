//! Skins: colours and weights for a body's surface.

use super::bones::Bones;
use super::field::Field;
use super::parts::Solid;
use super::surface::neighbours;
use super::{point, round};
use glam::DVec3;
use sinew::image::color::srgb8;
use sinew::io::rig_json::{Bind, Color, Mesh, Weights};
use std::collections::BTreeMap;

/// A smooth skin over a body. Weights begin with the nearest bone and spread `spread` times to the neighbours along the
/// surface, so that they are smooth and never leap across a gap. `paint` may change each vertex's colour, given its
/// position and normal.
pub fn skin(
    name: &str,
    material: &str,
    bones: &Bones,
    field: &Field,
    solid: Solid,
    spread: usize,
    paint: impl Fn(DVec3, DVec3, DVec3) -> DVec3,
) -> Mesh {
    let labels: Vec<usize> = solid.positions.iter().map(|p| field.nearest_bone(*p)).collect();
    let rows = diffuse(&labels, &neighbours(&solid), spread);
    let color = |p: &DVec3| hex(paint(*p, field.normal(*p), field.color(*p)));
    Mesh {
        name: name.into(),
        material: Some(material.into()),
        bind: weights(bones, &rows),
        crease_deg: None,
        colors: solid.positions.iter().map(color).collect(),
        positions: solid.positions.iter().map(|p| point(*p)).collect(),
        normals: Vec::new(),
        uvs: Vec::new(),
        triangles: solid.triangles,
        ..Default::default()
    }
}

/// The nearest 8-bit colour.
pub fn hex(linear: DVec3) -> Color {
    let [r, g, b] = linear.to_array().map(|c| srgb8(c as f32));
    Color::srgb8(r, g, b)
}

/// Weights of bones for every vertex.
pub type Row = BTreeMap<usize, f64>;

/// Start from one bone a vertex and mix each vertex half and half with its neighbours, `times` times.
pub fn diffuse(labels: &[usize], around: &[Vec<u32>], times: usize) -> Vec<Row> {
    let mut rows: Vec<Row> = labels.iter().map(|b| Row::from([(*b, 1.0)])).collect();
    for _ in 0..times {
        let mixed = around.iter().enumerate().map(|(i, list)| {
            let mut row = Row::new();
            let mut add = |from: &Row, share: f64| {
                from.iter().for_each(|(b, w)| *row.entry(*b).or_insert(0.0) += w * share);
            };
            add(&rows[i], 0.5);
            list.iter().for_each(|n| add(&rows[*n as usize], 0.5 / list.len() as f64));
            row.retain(|_, w| *w > 1e-6);
            row
        });
        rows = mixed.collect();
    }
    rows
}

/// At most four influences in thousandths that sum to one.
pub fn weights(bones: &Bones, rows: &[Row]) -> Bind {
    let mut used: Vec<usize> = Vec::new();
    let mut vertices = Vec::with_capacity(rows.len());
    for row in rows {
        let mut top: Vec<(usize, f64)> = row.iter().map(|(b, w)| (*b, *w)).collect();
        top.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        top.truncate(4);
        let sum: f64 = top.iter().map(|t| t.1).sum();
        let mut units: Vec<(usize, i64)> =
            top.iter().map(|(b, w)| (*b, (w / sum * 1000.0).round() as i64)).collect();
        units.retain(|u| u.1 > 4);
        // The strongest takes up what rounding left over.
        units[0].1 += 1000 - units.iter().map(|u| u.1).sum::<i64>();
        used.extend(units.iter().map(|u| u.0));
        vertices.push(units);
    }
    used.sort_unstable();
    used.dedup();
    let place = |b: usize| used.iter().position(|u| *u == b).unwrap_or(0) as u32;
    let pair = |(b, u): (usize, i64)| (place(b), round(u as f64 / 1000.0, 3) as f32);
    Bind::Weights(Weights {
        bones: used.iter().map(|b| bones.list[*b].name.clone()).collect(),
        inverse_bind: Vec::new(),
        vertices: vertices.into_iter().map(|v| v.into_iter().map(pair).collect()).collect(),
    })
}
