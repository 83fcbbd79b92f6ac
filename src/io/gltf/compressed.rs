//! Buffer views packed by EXT_meshopt_compression, and the later KHR_meshopt_compression.

use super::error::{GltfError, Result, value};
use ::gltf::json::buffer;
use meshoptimizer_rs::codec::{self, Filter, Mode};
use meshoptimizer_rs::{Limits, Workspace};
use serde::Deserialize;
use serde_json::{Map, Value};

const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What the extension says of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Packed {
    /// Index of the buffer with the packed bytes.
    pub buffer: usize,
    /// First packed byte in the buffer.
    #[serde(default, rename = "byteOffset")]
    pub offset: u64,
    /// Number of packed bytes.
    #[serde(rename = "byteLength")]
    pub length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

/// A buffer that stands in for unpacked data; it needs no bytes of its own.
pub(super) fn is_fallback(b: &buffer::Buffer) -> bool {
    let flag =
        |e: &Map<String, Value>| NAMES.iter().any(|n| e.get(*n).is_some_and(|v| v["fallback"] == true));
    b.extensions.as_ref().is_some_and(|e| flag(&e.others))
}

/// The packed form of a buffer view, if it has one.
pub(super) fn meshopt(view: &buffer::View, place: &str) -> Result<Option<Packed>> {
    let others = view.extensions.as_ref().map(|e| &e.others);
    let Some((name, v)) = others.and_then(|o| NAMES.iter().find_map(|n| o.get(*n).map(|v| (n, v)))) else {
        return Ok(None);
    };
    let packed = Packed::deserialize(v).map_err(|e| {
        value(format!("{place}.extensions.{name}"), "buffer, length, stride, count and mode", e.to_string())
    })?;
    Ok(Some(packed))
}

impl Packed {
    /// Bytes when unpacked.
    pub fn size(&self) -> u64 {
        self.count.saturating_mul(self.byte_stride)
    }

    /// Unpack; `source` has passed the check of its length.
    pub fn decode(&self, source: &[u8], place: &str) -> Result<Vec<u8>> {
        let wrong = |why: String| GltfError::Codec { place: place.into(), codec: "meshopt", why };
        let (count, stride) = (self.count as usize, self.byte_stride as usize);
        let mode = Mode::parse(&self.mode).map_err(|_| wrong(format!("unknown mode `{}`", self.mode)))?;
        let mut work = Workspace::new(Limits { max_bytes: 1 << 30, max_work: 1 << 32 });

        // The later extension adds one filter, for colours, and the second version of the vertex codec.
        if self.filter.as_deref() == Some("COLOR")
            || (mode == Mode::Attributes && source.first() == Some(&0xa1))
        {
            return self.decode_later(source, &mut work).map_err(|e| wrong(e.to_string()));
        }
        let filter = self.filter.as_deref().unwrap_or("NONE");
        let filter = Filter::parse(filter).map_err(|_| wrong(format!("unknown filter `{filter}`")))?;
        codec::decode_buffer_view(mode, filter, count, stride, source, &mut work)
            .map_err(|e| wrong(e.to_string()))
    }

    fn decode_later(
        &self,
        source: &[u8],
        work: &mut Workspace,
    ) -> std::result::Result<Vec<u8>, meshoptimizer_rs::Error> {
        let (count, stride) = (self.count as usize, self.byte_stride as usize);
        let mut bytes = codec::decode_vertex_buffer(count, stride, source, work)?;
        match self.filter.as_deref() {
            Some("OCTAHEDRAL") => codec::decode_filter_oct(&mut bytes, count, stride, work)?,
            Some("QUATERNION") => codec::decode_filter_quat(&mut bytes, count, stride, work)?,
            Some("EXPONENTIAL") => codec::decode_filter_exp(&mut bytes, count, stride, work)?,
            Some("COLOR") => codec::decode_filter_color(&mut bytes, count, stride, work)?,
            _ => {}
        }
        Ok(bytes)
    }
}
