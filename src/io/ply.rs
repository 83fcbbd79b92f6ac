//! Polygon files (PLY), as far as the notes' rigs use them: binary little-endian vertices and faces.
//!
//! Our own reader because it must not trust a header: sizes are checked against the bytes that are there before
//! anything is allocated.

use glam::DVec3;

/// Positions and triangles of a PLY file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ply {
    /// `V` positions in the file's unit, as precise as the file.
    pub positions: Vec<DVec3>,
    /// `F` triangles; polygons are cut into fans.
    pub triangles: Vec<[u32; 3]>,
}

/// Why bytes are no such file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlyError {
    /// Something in the text at the top.
    #[error("PLY header, line {line}: expected {expected}, found `{found}`")]
    Header {
        /// Counted from 1.
        line: usize,
        /// What would have been right.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// Less data than the header announces.
    #[error("PLY data ends in {element} {index} of {count}; the file is cut off or its header is wrong")]
    Truncated {
        /// Vertex or face.
        element: &'static str,
        /// Which one.
        index: usize,
        /// How many were announced.
        count: usize,
    },
    /// A face that names a vertex beyond the list.
    #[error("PLY face {face} uses vertex {vertex}, but there are {count}")]
    Index {
        /// Which face.
        face: usize,
        /// The vertex it asks for.
        vertex: i64,
        /// Vertices in the file.
        count: usize,
    },
}

/// Read a binary little-endian PLY.
///
/// # Errors
/// [`PlyError`], naming the header line or the element.
pub fn parse(bytes: &[u8]) -> Result<Ply, PlyError> {
    let (elements, mut data) = header(bytes)?;
    let mut ply = Ply::default();
    for e in &elements {
        match e.name.as_str() {
            "vertex" => read_vertices(e, &mut data, &mut ply)?,
            "face" => read_faces(e, &mut data, &mut ply)?,
            _ => skip(e, &mut data)?,
        }
    }
    Ok(ply)
}

/// Write a still as binary little-endian PLY: points, their normals if there are any, and triangles.
///
/// ```
/// use sinew::io::{ply, still::{Still, Surface}};
/// use glam::Vec3;
/// let surface = Surface { point: vec![0, 1, 2], triangles: vec![[0, 1, 2]], ..Surface::default() };
/// let still = Still { points: vec![Vec3::ZERO, Vec3::X, Vec3::Y], surfaces: vec![surface] };
/// assert_eq!(ply::parse(&ply::write(&still)).unwrap().triangles, [[0, 1, 2]]);
/// ```
pub fn write(still: &super::still::Still) -> Vec<u8> {
    let (normals, triangles) = (still.normals(), still.triangles().collect::<Vec<_>>());
    let mut head = format!(
        "ply\nformat binary_little_endian 1.0\ncomment metres, y up\nelement vertex {}\n",
        still.points.len()
    );
    let names = ["x", "y", "z", "nx", "ny", "nz"];
    for name in &names[..if normals.is_empty() { 3 } else { 6 }] {
        head += &format!("property float {name}\n");
    }
    head +=
        &format!("element face {}\nproperty list uchar int vertex_indices\nend_header\n", triangles.len());
    let mut out = head.into_bytes();
    for (i, p) in still.points.iter().enumerate() {
        let numbers = p.to_array().into_iter().chain(normals.get(i).into_iter().flat_map(|n| n.to_array()));
        out.extend(numbers.flat_map(f32::to_le_bytes));
    }
    for t in triangles {
        out.push(3);
        out.extend(t.iter().flat_map(|i| i.to_le_bytes()));
    }
    out
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

struct Property {
    name: String,
    kind: Kind,
    /// Type of the count in front of a list.
    list: Option<Kind>,
}

#[derive(Clone, Copy)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// The next number, as f64; every PLY type fits exactly.
    fn read(self, data: &mut &[u8]) -> Option<f64> {
        Some(match self {
            Self::I8 => i8::from_le_bytes(take(data)?) as f64,
            Self::U8 => u8::from_le_bytes(take(data)?) as f64,
            Self::I16 => i16::from_le_bytes(take(data)?) as f64,
            Self::U16 => u16::from_le_bytes(take(data)?) as f64,
            Self::I32 => i32::from_le_bytes(take(data)?) as f64,
            Self::U32 => u32::from_le_bytes(take(data)?) as f64,
            Self::F32 => f32::from_le_bytes(take(data)?) as f64,
            Self::F64 => f64::from_le_bytes(take(data)?),
        })
    }
}

fn take<const N: usize>(data: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = data.split_first_chunk::<N>()?;
    *data = tail;
    Some(*head)
}

fn header(bytes: &[u8]) -> Result<(Vec<Element>, &[u8]), PlyError> {
    let mut elements: Vec<Element> = Vec::new();
    let mut rest = bytes;
    for line in 1.. {
        let end = rest.iter().take(4096).position(|&b| b == b'\n');
        let text = String::from_utf8_lossy(&rest[..end.unwrap_or(rest.len().min(60))]);
        let text = text.trim();
        let wrong = |expected| Err(PlyError::Header { line, expected, found: text.to_string() });
        let Some(end) = end else { return wrong("a line of text") };
        rest = &rest[end + 1..];
        let words: Vec<&str> = text.split_whitespace().collect();
        match (line, words.as_slice()) {
            (1, ["ply"]) => {}
            (1, _) => return wrong("ply"),
            (_, ["format", "binary_little_endian", "1.0"]) | (_, ["comment" | "obj_info", ..]) => {}
            (_, ["element", name, count]) => match count.parse() {
                Ok(count) => elements.push(Element { name: name.to_string(), count, properties: vec![] }),
                Err(_) => return wrong("a number of elements"),
            },
            (_, ["property", ..]) => match (property(&words), elements.last_mut()) {
                (Some(p), Some(e)) => e.properties.push(p),
                _ => return wrong("an element, then `property TYPE NAME` or `property list TYPE TYPE NAME`"),
            },
            (_, ["end_header"]) => return Ok((elements, rest)),
            _ => return wrong("`format binary_little_endian 1.0`, element, property or end_header"),
        }
    }
    unreachable!("the loop ends with the file")
}

fn property(words: &[&str]) -> Option<Property> {
    match words {
        ["property", "list", count, kind, name] => Some(Property {
            name: name.to_string(),
            kind: Kind::parse(kind)?,
            list: Some(Kind::parse(count)?),
        }),
        ["property", kind, name] => {
            Some(Property { name: name.to_string(), kind: Kind::parse(kind)?, list: None })
        }
        _ => None,
    }
}

/// Read one property: its numbers go to `each`; `None` at the end of the data.
fn read_property(p: &Property, data: &mut &[u8], mut each: impl FnMut(f64)) -> Option<()> {
    let n = match p.list {
        Some(count) => count.read(data)?.max(0.0) as usize,
        None => 1,
    };
    for _ in 0..n {
        each(p.kind.read(data)?);
    }
    Some(())
}

fn read_vertices(e: &Element, data: &mut &[u8], ply: &mut Ply) -> Result<(), PlyError> {
    for index in 0..e.count {
        let cut = || PlyError::Truncated { element: "vertex", index, count: e.count };
        let mut p = DVec3::ZERO;
        // Without properties a vertex takes no bytes, and any count would do.
        if e.properties.is_empty() {
            return Err(cut());
        }
        for prop in &e.properties {
            read_property(prop, data, |v| match prop.name.as_str() {
                "x" => p.x = v,
                "y" => p.y = v,
                "z" => p.z = v,
                _ => {}
            })
            .ok_or_else(cut)?;
        }
        ply.positions.push(p);
    }
    Ok(())
}

fn read_faces(e: &Element, data: &mut &[u8], ply: &mut Ply) -> Result<(), PlyError> {
    let count = ply.positions.len();
    let mut corners: Vec<u32> = Vec::new();
    for face in 0..e.count {
        let cut = || PlyError::Truncated { element: "face", index: face, count: e.count };
        if e.properties.is_empty() {
            return Err(cut());
        }
        corners.clear();
        let mut bad = None;
        for prop in &e.properties {
            let is_corners = matches!(prop.name.as_str(), "vertex_indices" | "vertex_index");
            read_property(prop, data, |v| match (is_corners, v >= 0.0 && v < count as f64) {
                (true, true) => corners.push(v as u32),
                (true, false) => bad = Some(v as i64),
                (false, _) => {}
            })
            .ok_or_else(cut)?;
        }
        if let Some(vertex) = bad {
            return Err(PlyError::Index { face, vertex, count });
        }
        for k in 2..corners.len() {
            ply.triangles.push([corners[0], corners[k - 1], corners[k]]);
        }
    }
    Ok(())
}

fn skip(e: &Element, data: &mut &[u8]) -> Result<(), PlyError> {
    if e.properties.is_empty() {
        return Ok(());
    }
    for index in 0..e.count {
        for p in &e.properties {
            read_property(p, data, |_| {}).ok_or(PlyError::Truncated {
                element: "element",
                index,
                count: e.count,
            })?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetra() -> Vec<u8> {
        let mut b = b"ply\nformat binary_little_endian 1.0\ncomment by hand\nelement vertex 4\nproperty double x\n\
            property double y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
            .to_vec();
        for i in 0..4 {
            b.extend((i as f64).to_le_bytes());
            b.extend(0.5_f64.to_le_bytes());
            b.extend(2.0_f32.to_le_bytes());
        }
        b.push(4);
        [0i32, 1, 2, 3].iter().for_each(|i| b.extend(i.to_le_bytes()));
        b
    }

    #[test]
    fn mixed_types_and_polygons() {
        let p = parse(&tetra()).unwrap();
        assert_eq!(p.positions[3], DVec3::new(3.0, 0.5, 2.0));
        assert_eq!(p.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn cut_or_changed_files_give_errors() {
        let good = tetra();
        for n in 0..good.len() {
            assert!(parse(&good[..n]).is_err(), "{n}");
        }
        let mut bad = good.clone();
        *bad.last_mut().unwrap() = 0x70;
        assert!(parse(&bad).unwrap_err().to_string().contains("face 0 uses vertex"));
        let huge = b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nend_header\n";
        assert!(matches!(parse(huge), Err(PlyError::Truncated { .. })));
    }
}
