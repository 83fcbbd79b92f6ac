//! Half-edges: what is closed, what is a manifold, how many handles it has (notes §5.4–5.8).

use glam::Vec3;

/// No half-edge runs the other way: the edge is a boundary, or more than two faces share it.
pub const NO_TWIN: u32 = u32::MAX;

/// Half-edges of an indexed triangle mesh: half-edge `3f+k` runs from corner `k` of face `f` to corner `k+1`.
#[derive(Clone, Debug)]
pub struct HalfEdges {
    twins: Vec<u32>,
    boundary: usize,
    tangled: usize,
    edges: usize,
}

/// Counts that describe a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Vertices that a triangle uses.
    pub vertices: usize,
    /// Undirected edges.
    pub edges: usize,
    /// Triangles.
    pub faces: usize,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Edges with more than two faces, or with two that run the same way.
    pub tangled_edges: usize,
    /// Connected components (by shared vertices).
    pub components: usize,
    /// `V − E + F`; `2(1 − g)` for each closed component of genus `g`.
    pub euler: i64,
}

impl Summary {
    /// Watertight: there are faces, and every edge has exactly two that run against each other.
    pub fn closed(&self) -> bool {
        self.faces > 0 && self.boundary_edges == 0 && self.tangled_edges == 0
    }
}

impl HalfEdges {
    /// Pair the half-edges of `triangles`.
    ///
    /// ```
    /// let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    /// let h = sinew::mesh::topology::HalfEdges::new(&tetrahedron);
    /// assert!((0..12).all(|e| h.twin(h.twin(e).unwrap()) == Some(e)));
    /// assert_eq!(h.summary(&tetrahedron).euler, 2);
    /// ```
    pub fn new(triangles: &[[u32; 3]]) -> Self {
        // Sort by undirected edge; a pair that runs in opposite directions are twins.
        let mut list: Vec<(u32, u32, u32)> = Vec::with_capacity(triangles.len() * 3);
        for (f, t) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                list.push((a.min(b), a.max(b), (3 * f + k) as u32));
            }
        }
        list.sort_unstable();
        let from = |e: u32| triangles[e as usize / 3][e as usize % 3];
        let mut out = Self { twins: vec![NO_TWIN; list.len()], boundary: 0, tangled: 0, edges: 0 };
        for run in list.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            out.edges += 1;
            match run {
                [_] => out.boundary += 1,
                [a, b] if from(a.2) != from(b.2) => {
                    out.twins[a.2 as usize] = b.2;
                    out.twins[b.2 as usize] = a.2;
                }
                _ => out.tangled += 1,
            }
        }
        out
    }

    /// The half-edge that runs the other way along the same edge.
    pub fn twin(&self, half_edge: u32) -> Option<u32> {
        Some(self.twins[half_edge as usize]).filter(|&t| t != NO_TWIN)
    }

    /// Count everything.
    pub fn summary(&self, triangles: &[[u32; 3]]) -> Summary {
        let labels = components(triangles);
        let vertices = labels.iter().filter(|&&l| l != u32::MAX).count();
        let components = labels.iter().filter(|&&l| l != u32::MAX).max().map_or(0, |&m| m as usize + 1);
        Summary {
            vertices,
            edges: self.edges,
            faces: triangles.len(),
            boundary_edges: self.boundary,
            tangled_edges: self.tangled,
            components,
            euler: vertices as i64 - self.edges as i64 + triangles.len() as i64,
        }
    }
}

/// Number of the connected component of each vertex, counted from 0 in order of first use; `u32::MAX` where no triangle
/// uses the vertex.
pub fn components(triangles: &[[u32; 3]]) -> Vec<u32> {
    let n = triangles.iter().flatten().max().map_or(0, |&m| m as usize + 1);
    let mut root: Vec<u32> = (0..n as u32).collect();
    // Union-find with path halving.
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for t in triangles {
        let r = t.map(|i| find(&mut root, i));
        let low = r[0].min(r[1]).min(r[2]);
        r.iter().for_each(|&i| root[i as usize] = low);
    }
    let mut label = vec![u32::MAX; n];
    let mut name = vec![u32::MAX; n];
    let mut next = 0;
    for &i in triangles.iter().flatten() {
        let r = find(&mut root, i) as usize;
        if name[r] == u32::MAX {
            name[r] = next;
            next += 1;
        }
        label[i as usize] = name[r];
    }
    label
}

/// For each vertex the first vertex at the very same place: files split vertices along seams, surfaces do not.
pub fn weld(positions: &[Vec3]) -> Vec<u32> {
    let key = |p: &Vec3| (*p + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_by_key(|&i| (key(&positions[i as usize]), i));
    let mut first = vec![0; positions.len()];
    for run in order.chunk_by(|&a, &b| key(&positions[a as usize]) == key(&positions[b as usize])) {
        run.iter().for_each(|&i| first[i as usize] = run[0]);
    }
    first
}

/// V, E, F and the rest of the surface behind a mesh: vertices at one place count once, degenerate triangles not at all.
pub fn surface(positions: &[Vec3], triangles: &[[u32; 3]]) -> Summary {
    let first = weld(positions);
    let welded = triangles.iter().map(|t| t.map(|i| first[i as usize]));
    let proper: Vec<[u32; 3]> = welded.filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect();
    HalfEdges::new(&proper).summary(&proper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lone_triangle_is_open() {
        let s = HalfEdges::new(&[[0, 1, 2]]).summary(&[[0, 1, 2]]);
        assert_eq!((s.vertices, s.edges, s.boundary_edges, s.components, s.euler), (3, 3, 3, 1, 1));
        assert!(!s.closed());
    }

    #[test]
    fn two_faces_that_run_the_same_way_are_tangled() {
        let s = HalfEdges::new(&[[0, 1, 2], [0, 1, 3]]).summary(&[[0, 1, 2], [0, 1, 3]]);
        assert_eq!((s.tangled_edges, s.boundary_edges), (1, 4));
    }

    #[test]
    fn seams_are_welded() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(-0.0, 0.0, 0.0), Vec3::X, Vec3::Y];
        let s = surface(&p, &[[0, 1, 2], [3, 5, 4]]);
        assert_eq!((s.vertices, s.faces, s.closed()), (3, 2, true));
    }
}
