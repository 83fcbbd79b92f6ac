//! The surface of a field as even triangles: surface nets, pulled onto the surface and relaxed along it.

use super::field::Field;
use super::parts::Solid;
use glam::DVec3;

/// Triangles of about the size of `cell`, metres, on the field's surface.
pub fn polygonise(field: &Field, cell: f64) -> Solid {
    let grid = Grid::new(field, cell);
    let mut solid = grid.net();
    for _ in 0..4 {
        relax(&mut solid, field, cell);
    }
    solid.positions.iter_mut().for_each(|p| *p = pulled(field, *p, cell));
    solid
}

struct Grid {
    origin: DVec3,
    cell: f64,
    size: [usize; 3],
    values: Vec<f64>,
}

impl Grid {
    fn new(field: &Field, cell: f64) -> Self {
        // Whole cells from the origin: left and right then fall on mirrored points.
        let (lo, hi) = field.bounds();
        let (lo, hi) = (lo / cell - 1.5, hi / cell + 1.5);
        let (lo, hi) = (lo.floor(), hi.ceil());
        let size = (hi - lo).to_array().map(|n| n as usize + 1);
        let mut grid = Self { origin: lo * cell, cell, size, values: Vec::new() };
        for k in 0..size[2] {
            for j in 0..size[1] {
                for i in 0..size[0] {
                    grid.values.push(field.distance(grid.place([i, j, k])));
                }
            }
        }
        grid
    }

    fn place(&self, at: [usize; 3]) -> DVec3 {
        self.origin + DVec3::new(at[0] as f64, at[1] as f64, at[2] as f64) * self.cell
    }

    fn index(&self, at: [usize; 3]) -> usize {
        (at[2] * self.size[1] + at[1]) * self.size[0] + at[0]
    }

    fn value(&self, at: [usize; 3]) -> f64 {
        self.values[self.index(at)]
    }

    /// One vertex in each cell that the surface crosses, one quad around each edge that it crosses.
    fn net(&self) -> Solid {
        let mut solid = Solid::default();
        let mut vertex = vec![u32::MAX; self.values.len()];
        let [nx, ny, nz] = self.size;
        for k in 0..nz - 1 {
            for j in 0..ny - 1 {
                for i in 0..nx - 1 {
                    if let Some(p) = self.crossing([i, j, k]) {
                        vertex[self.index([i, j, k])] = solid.positions.len() as u32;
                        solid.positions.push(p);
                    }
                }
            }
        }
        for k in 1..nz - 1 {
            for j in 1..ny - 1 {
                for i in 1..nx - 1 {
                    for axis in 0..3 {
                        self.quad([i, j, k], axis, &vertex, &mut solid);
                    }
                }
            }
        }
        solid
    }

    /// The mean of where the cell's edges are crossed.
    fn crossing(&self, at: [usize; 3]) -> Option<DVec3> {
        let corner = |c: usize| [at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2)];
        let mut sum = (DVec3::ZERO, 0.0);
        for a in 0..8 {
            for axis in 0..3 {
                let b = a | 1 << axis;
                let (va, vb) = (self.value(corner(a)), self.value(corner(b)));
                if b != a && (va < 0.0) != (vb < 0.0) {
                    let p = self.place(corner(a)).lerp(self.place(corner(b)), va / (va - vb));
                    sum = (sum.0 + p, sum.1 + 1.0);
                }
            }
        }
        (sum.1 > 0.0).then(|| sum.0 / sum.1)
    }

    fn quad(&self, at: [usize; 3], axis: usize, vertex: &[u32], solid: &mut Solid) {
        let mut next = at;
        next[axis] += 1;
        let (inside, other) = (self.value(at) < 0.0, self.value(next) < 0.0);
        if inside == other {
            return;
        }
        // The four cells around the edge, counter-clockwise seen from its far end.
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let cell = |du: usize, dv: usize| {
            let mut c = at;
            c[u] -= 1 - du;
            c[v] -= 1 - dv;
            vertex[self.index(c)]
        };
        let mut q = [cell(0, 0), cell(1, 0), cell(1, 1), cell(0, 1)];
        if !inside {
            q.reverse();
        }
        // Cut along the shorter diagonal.
        let p = |i: usize| solid.positions[q[i] as usize];
        let cut = p(0).distance(p(2)) < p(1).distance(p(3)) - 1e-9;
        let t = if cut {
            [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]
        } else {
            [[q[1], q[2], q[3]], [q[1], q[3], q[0]]]
        };
        solid.triangles.extend(t);
    }
}

/// Neighbours of every vertex, ascending.
pub fn neighbours(solid: &Solid) -> Vec<Vec<u32>> {
    let mut all = vec![Vec::new(); solid.positions.len()];
    for t in &solid.triangles {
        for k in 0..3 {
            all[t[k] as usize].extend([t[(k + 1) % 3], t[(k + 2) % 3]]);
        }
    }
    for list in &mut all {
        list.sort_unstable();
        list.dedup();
    }
    all
}

/// Move vertices towards the middle of their neighbours along the surface, then back onto it.
fn relax(solid: &mut Solid, field: &Field, cell: f64) {
    let around = neighbours(solid);
    let moved = solid.positions.iter().zip(&around).map(|(p, list)| {
        let middle = list.iter().map(|i| solid.positions[*i as usize]).sum::<DVec3>() / list.len() as f64;
        let n = field.normal(*p);
        let step = middle - *p;
        pulled(field, *p + (step - n * n.dot(step)) * 0.6, cell)
    });
    solid.positions = moved.collect();
}

/// The point of the surface near `p`, by a few steps of Newton's method.
fn pulled(field: &Field, mut p: DVec3, cell: f64) -> DVec3 {
    for _ in 0..3 {
        let d = field.distance(p).clamp(-0.5 * cell, 0.5 * cell);
        p -= field.normal(p) * d;
    }
    p
}
