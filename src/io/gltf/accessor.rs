//! Reading accessors: every component type, normalised, strided, sparse, or without data at all.

use super::document::Document;
use super::error::{GltfError, Result, entry, value};
use ::gltf::json::accessor::{Accessor, ComponentType, Type, sparse::Sparse};
use ::gltf::json::validation::Checked;

/// The elements of an accessor: `count` times `width` numbers.
pub(super) struct Elements<T> {
    /// Numbers an element; matrices column by column, without padding.
    pub width: usize,
    /// All numbers.
    pub values: Vec<T>,
}

impl<T> Elements<T> {
    /// The elements, one slice each.
    pub fn iter(&self) -> std::slice::ChunksExact<'_, T> {
        self.values.chunks_exact(self.width)
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.values.len() / self.width
    }
}

/// How an accessor's bytes are laid out.
struct Layout {
    component: ComponentType,
    rows: usize,
    columns: usize,
    /// Bytes from one column to the next; columns of matrices start at multiples of four.
    column_stride: usize,
}

impl Layout {
    fn new(component: ComponentType, shape: Type) -> Self {
        let (rows, columns) = match shape {
            Type::Scalar => (1, 1),
            Type::Vec2 => (2, 1),
            Type::Vec3 => (3, 1),
            Type::Vec4 => (4, 1),
            Type::Mat2 => (2, 2),
            Type::Mat3 => (3, 3),
            Type::Mat4 => (4, 4),
        };
        let packed = rows * component.size();
        let column_stride = if columns > 1 { packed.next_multiple_of(4) } else { packed };
        Self { component, rows, columns, column_stride }
    }

    fn width(&self) -> usize {
        self.rows * self.columns
    }

    /// Bytes from one tightly packed element to the next.
    fn element(&self) -> usize {
        self.column_stride * self.columns
    }

    /// Bytes that an element really needs: the last column has no padding behind it.
    fn extent(&self) -> usize {
        self.column_stride * (self.columns - 1) + self.rows * self.component.size()
    }
}

impl Document<'_> {
    /// Numbers as f32: floats as they are, normalised integers as fractions, others as whole numbers.
    pub fn floats(&self, index: usize, shapes: &[Type], place: &str) -> Result<Elements<f32>> {
        let (accessor, layout) = self.described(index, shapes, place)?;
        let scale = if accessor.normalized { unit(layout.component) } else { 1.0 };
        let convert = |b: &[u8]| match layout.component {
            ComponentType::I8 => b[0] as i8 as f32 / scale,
            ComponentType::U8 => b[0] as f32 / scale,
            ComponentType::I16 => i16::from_le_bytes([b[0], b[1]]) as f32 / scale,
            ComponentType::U16 => u16::from_le_bytes([b[0], b[1]]) as f32 / scale,
            ComponentType::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32 / scale,
            ComponentType::F32 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        let mut out = self.read(index, accessor, &layout, place, convert)?;
        if accessor.normalized && layout.component != ComponentType::F32 {
            // The most negative integer means −1 as well.
            out.values.iter_mut().for_each(|v| *v = v.max(-1.0));
        }
        Ok(out)
    }

    /// Whole numbers: indices and joints.
    pub fn integers(&self, index: usize, shapes: &[Type], place: &str) -> Result<Elements<u32>> {
        let (accessor, layout) = self.described(index, shapes, place)?;
        let unsigned = [ComponentType::U8, ComponentType::U16, ComponentType::U32];
        // Floats that hold whole numbers were written by early exporters for joints.
        let found = layout.component;
        let whole_floats = found == ComponentType::F32 && shapes != [Type::Scalar];
        if !unsigned.contains(&found) && !whole_floats {
            return Err(value(
                format!("accessors[{index}].componentType"),
                "an unsigned integer type",
                format!("{found:?} (used by {place})"),
            ));
        }
        let convert = |b: &[u8]| match found {
            ComponentType::U8 => b[0] as u32,
            ComponentType::U16 => u16::from_le_bytes([b[0], b[1]]) as u32,
            ComponentType::F32 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]) as u32,
            _ => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        self.read(index, accessor, &layout, place, convert)
    }

    /// Number of elements that an accessor declares.
    pub fn count(&self, index: usize, place: &str) -> Result<u64> {
        Ok(entry(&self.root.accessors, index, "accessor", || place.into())?.count.0)
    }

    /// Numbers an element of an accessor.
    pub fn width(&self, index: usize, shapes: &[Type], place: &str) -> Result<usize> {
        Ok(self.described(index, shapes, place)?.1.width())
    }

    fn described(&self, index: usize, shapes: &[Type], place: &str) -> Result<(&Accessor, Layout)> {
        let accessor = entry(&self.root.accessors, index, "accessor", || place.into())?;
        let at = |field| format!("accessors[{index}].{field}");
        let Checked::Valid(component) = accessor.component_type else {
            return Err(value(at("componentType"), "5120, 5121, 5122, 5123, 5125 or 5126", "another number"));
        };
        let Checked::Valid(shape) = accessor.type_ else {
            return Err(value(at("type"), "SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4", "another word"));
        };
        if !shapes.contains(&shape) {
            let wanted: Vec<&str> = shapes.iter().map(|s| word(*s)).collect();
            let expected = format!("{} for {place}", wanted.join(" or "));
            return Err(value(at("type"), expected, word(shape)));
        }
        Ok((accessor, Layout::new(component.0, shape)))
    }

    fn read<T: Copy + Default>(
        &self,
        index: usize,
        accessor: &Accessor,
        layout: &Layout,
        place: &str,
        convert: impl Fn(&[u8]) -> T,
    ) -> Result<Elements<T>> {
        let (width, count) = (layout.width(), accessor.count.0);
        let at = format!("accessors[{index}]");

        // Locate the bytes before anything is allocated for them.
        let source = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |o| o.0);
                Some(self.strided(view.value(), offset, count, layout, &at)?)
            }
            None => None,
        };
        self.charge(count.saturating_mul(4 * width as u64), &format!("{at} (used by {place})"))?;
        let mut values = vec![T::default(); count as usize * width];
        if let Some((bytes, stride)) = source {
            let elements = values.chunks_exact_mut(width).enumerate();
            elements.for_each(|(i, out)| fill(&bytes[i * stride..], layout, out, &convert));
        }
        if let Some(sparse) = &accessor.sparse {
            self.replace(sparse, layout, &mut values, &at, &convert)?;
        }
        Ok(Elements { width, values })
    }

    /// Bytes from the first element on, and the stride; all `count` elements are inside.
    fn strided(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        layout: &Layout,
        place: &str,
    ) -> Result<(&[u8], usize)> {
        let (bytes, view_json) = self.view(view, &format!("{place}.bufferView"))?;
        let stride = match view_json.byte_stride.map_or(0, |s| s.0) {
            0 => layout.element(),
            s if s < layout.extent() || s > 1 << 16 => {
                let expected = format!("at least {} bytes an element of {place}", layout.extent());
                return Err(value(format!("bufferViews[{view}].byteStride"), expected, s.to_string()));
            }
            s => s,
        };
        let span = match count.checked_sub(1) {
            Some(steps) => steps.saturating_mul(stride as u64).saturating_add(layout.extent() as u64),
            None => 0,
        };
        let needed = offset.saturating_add(span);
        if needed > bytes.len() as u64 {
            let (of, found) = (format!("bufferViews[{view}]"), bytes.len() as u64);
            return Err(GltfError::Bytes { place: place.into(), needed, of, found });
        }
        Ok((&bytes[offset as usize..], stride))
    }

    /// Overwrite the elements that a sparse accessor lists.
    fn replace<T: Copy + Default>(
        &self,
        sparse: &Sparse,
        layout: &Layout,
        values: &mut [T],
        at: &str,
        convert: &impl Fn(&[u8]) -> T,
    ) -> Result<()> {
        let at_indices = format!("{at}.sparse.indices");
        let Checked::Valid(kind) = sparse.indices.component_type else {
            return Err(value(format!("{at_indices}.componentType"), "5121, 5123 or 5125", "another number"));
        };
        let index_layout = Layout::new(kind.0, Type::Scalar);
        let n = sparse.count.0;
        let view = sparse.indices.buffer_view.value();
        let (indices, index_stride) =
            self.strided(view, sparse.indices.byte_offset.0, n, &index_layout, &at_indices)?;
        let view = sparse.values.buffer_view.value();
        let (bytes, stride) =
            self.strided(view, sparse.values.byte_offset.0, n, layout, &format!("{at}.sparse.values"))?;

        let width = layout.width();
        for k in 0..n as usize {
            let b = &indices[k * index_stride..];
            let target = match kind.0 {
                ComponentType::U8 => b[0] as usize,
                ComponentType::U16 => u16::from_le_bytes([b[0], b[1]]) as usize,
                _ => u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize,
            };
            let count = values.len() / width;
            let out = values.get_mut(target * width..(target + 1) * width).ok_or_else(|| {
                let place = format!("{at_indices}[{k}]");
                GltfError::Index { place, what: "element", index: target, count }
            })?;
            fill(&bytes[k * stride..], layout, out, convert);
        }
        Ok(())
    }
}

fn fill<T>(bytes: &[u8], layout: &Layout, out: &mut [T], convert: &impl Fn(&[u8]) -> T) {
    let size = layout.component.size();
    for (k, o) in out.iter_mut().enumerate() {
        let (column, row) = (k / layout.rows, k % layout.rows);
        *o = convert(&bytes[column * layout.column_stride + row * size..][..size]);
    }
}

/// The integer that a normalised component calls 1.
fn unit(component: ComponentType) -> f32 {
    match component {
        ComponentType::I8 => 127.0,
        ComponentType::U8 => 255.0,
        ComponentType::I16 => 32767.0,
        ComponentType::U16 => 65535.0,
        ComponentType::U32 => 4_294_967_295.0,
        ComponentType::F32 => 1.0,
    }
}

/// A shape as the file spells it.
fn word(shape: Type) -> &'static str {
    match shape {
        Type::Scalar => "SCALAR",
        Type::Vec2 => "VEC2",
        Type::Vec3 => "VEC3",
        Type::Vec4 => "VEC4",
        Type::Mat2 => "MAT2",
        Type::Mat3 => "MAT3",
        Type::Mat4 => "MAT4",
    }
}
