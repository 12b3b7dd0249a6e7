//! The numbers of glTF accessors: plain, quantized (`KHR_mesh_quantization`) and sparse.
//!
//! They are read here because the crate's readers trust the counts and offsets of the file (1.4.1: `count - 1` underflows,
//! strides are only asserted), and scenes may be untrusted.

use std::borrow::Cow;

use glam::{DVec2, DVec3};
use gltf::accessor::sparse::IndexType;
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::View;
use gltf::{Accessor, Document};

use super::super::super::memory;
use super::super::Problem;
use super::{DAMAGED, unsupported};

/// The bytes of all buffers.
pub struct Numbers<'b> {
    pub buffers: Vec<Cow<'b, [u8]>>,
    /// Whether the file declares quantized numbers: only then may texture coordinates be unnormalized integers.
    pub quantized: bool,
}

/// Large enough for the largest item.
type Item = [f64; 16];

impl Numbers<'_> {
    /// Positions, normals, or offsets of them: three numbers each.
    pub fn vectors(&self, accessor: &Accessor<'_>) -> Result<Vec<DVec3>, Problem> {
        let narrow = matches!(
            accessor.data_type(),
            DataType::I8 | DataType::U8 | DataType::I16 | DataType::U16
        );
        if accessor.dimensions() != Dimensions::Vec3 || !(narrow || accessor.data_type() == DataType::F32) {
            return Err(unsupported(
                "positions or normals that are not three numbers of 8, 16 or 32 bits",
            ));
        }
        let mut all = Vec::with_capacity(accessor.count().min(1 << 20));
        self.each(accessor, accessor.normalized(), |item| {
            all.push(DVec3::new(item[0], item[1], item[2]))
        })?;
        Ok(all)
    }

    /// Texture coordinates. In glTF `v` points down.
    pub fn coordinates(&self, accessor: &Accessor<'_>) -> Result<Vec<DVec2>, Problem> {
        let whole = matches!(
            accessor.data_type(),
            DataType::I8 | DataType::U8 | DataType::I16 | DataType::U16
        );
        if accessor.dimensions() != Dimensions::Vec2 || !(whole || accessor.data_type() == DataType::F32) {
            return Err(unsupported(
                "texture coordinates that are not pairs of 32-bit numbers or of whole numbers of 8 or 16 bits",
            ));
        }
        let mut all = Vec::with_capacity(accessor.count().min(1 << 20));
        let normalized = accessor.normalized() || !self.quantized;
        self.each(accessor, normalized, |item| {
            all.push(DVec2::new(item[0], 1.0 - item[1]))
        })?;
        Ok(all)
    }

    pub fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>, Problem> {
        let whole = matches!(accessor.data_type(), DataType::U8 | DataType::U16 | DataType::U32);
        if accessor.dimensions() != Dimensions::Scalar || !whole {
            return Err(unsupported("indices that are not whole numbers"));
        }
        let mut all = Vec::with_capacity(accessor.count().min(1 << 20));
        self.each(accessor, false, |item| all.push(item[0] as u32))?;
        Ok(all)
    }

    /// Items of other kinds, such as weights, joints, matrices and instance transforms.
    pub fn items(
        &self,
        accessor: &Accessor<'_>,
        dimensions: Dimensions,
        normalized: bool,
    ) -> Result<Vec<Item>, Problem> {
        if accessor.dimensions() != dimensions {
            return Err(unsupported(
                "joints, weights, matrices or instances of a kind that glTF does not have for them",
            ));
        }
        let mut all = Vec::with_capacity(accessor.count().min(1 << 20));
        self.each(accessor, normalized, |item| all.push(*item))?;
        Ok(all)
    }

    /// Passes all items of an accessor to `take` in order.
    fn each(&self, accessor: &Accessor<'_>, normalized: bool, mut take: impl FnMut(&Item)) -> Result<(), Problem> {
        let (kind, parts) = (accessor.data_type(), accessor.dimensions().multiplicity());
        let size = kind.size() * parts;
        let count = accessor.count();
        let outside = || {
            Problem::new(
                format!("has accessor {} outside of its buffer", accessor.index()),
                DAMAGED,
            )
        };
        if count == 0 {
            return Err(outside());
        }
        // An accessor without a buffer can claim any length.
        if accessor.view().is_none() && !memory::fits((count as u64).saturating_mul(size_of::<Item>() as u64)) {
            let what = format!(
                "has more numbers in accessor {} than fit into the memory that is free",
                accessor.index()
            );
            return Err(Problem::new(what, "use a smaller mesh"));
        }
        let view = accessor.view().map(|view| {
            let stride = view.stride().unwrap_or(size);
            self.run(&view, accessor.offset(), count, stride, size)
                .map(|bytes| (bytes, stride))
        });
        let base = view.transpose().map_err(|()| outside())?;
        let replaced = self.replaced(accessor, size).map_err(|()| outside())?;
        let mut replaced = replaced.into_iter().peekable();
        let mut item = [0.0; 16];
        for i in 0..count {
            let mut bytes = base.map(|(bytes, stride)| &bytes[i * stride..i * stride + size]);
            // The last of several replacements counts.
            while let Some((_, own)) = replaced.next_if(|(at, _)| *at as usize <= i) {
                bytes = Some(own);
            }
            for (part, value) in item[..parts].iter_mut().enumerate() {
                *value = bytes.map_or(0.0, |bytes| number(kind, &bytes[part * kind.size()..], normalized));
            }
            take(&item);
        }
        Ok(())
    }

    /// The items that a sparse accessor replaces, with their indices, in order.
    fn replaced(&self, accessor: &Accessor<'_>, size: usize) -> Result<Vec<(u32, &[u8])>, ()> {
        let Some(sparse) = accessor.sparse() else {
            return Ok(Vec::new());
        };
        let (indices, values, count) = (sparse.indices(), sparse.values(), sparse.count());
        if count == 0 {
            return Ok(Vec::new());
        }
        let (kind, width) = match indices.index_type() {
            IndexType::U8 => (DataType::U8, 1),
            IndexType::U16 => (DataType::U16, 2),
            IndexType::U32 => (DataType::U32, 4),
        };
        let numbers = self.run(&indices.view(), indices.offset(), count, width, width)?;
        let values = self.run(&values.view(), values.offset(), count, size, size)?;
        let numbers = numbers
            .chunks_exact(width)
            .map(|bytes| number(kind, bytes, false) as u32);
        let mut replaced: Vec<_> = numbers.zip(values.chunks_exact(size)).collect();
        replaced.sort_by_key(|(index, _)| *index);
        let fits = replaced
            .last()
            .is_none_or(|(index, _)| (*index as usize) < accessor.count());
        fits.then_some(replaced).ok_or(())
    }

    /// The bytes of `count` items of `size` bytes at distance `stride`, if they exist.
    fn run(&self, view: &View<'_>, offset: usize, count: usize, stride: usize, size: usize) -> Result<&[u8], ()> {
        let end = view.offset().checked_add(view.length()).ok_or(())?;
        let buffer = self.buffers.get(view.buffer().index()).ok_or(())?;
        let bytes = buffer
            .get(view.offset()..end)
            .and_then(|view| view.get(offset..))
            .ok_or(())?;
        let needed = (count - 1).checked_mul(stride).and_then(|last| last.checked_add(size));
        let enough = stride >= size && needed.is_some_and(|needed| needed <= bytes.len());
        enough.then_some(bytes).ok_or(())
    }
}

/// Decodes the number at the start of `bytes`. Normalized integers are fractions of their maximum (glTF 2.0, 3.6.2.2).
fn number(kind: DataType, bytes: &[u8], normalized: bool) -> f64 {
    let (value, largest) = match kind {
        DataType::I8 => (f64::from(bytes[0] as i8), 127.0),
        DataType::U8 => (f64::from(bytes[0]), 255.0),
        DataType::I16 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32_767.0),
        DataType::U16 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65_535.0),
        DataType::U32 => (
            f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            f64::from(u32::MAX),
        ),
        DataType::F32 => return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

/// The accessor with this index in JSON.
pub fn accessor<'d>(document: &'d Document, index: &gltf::json::Value) -> Result<Accessor<'d>, Problem> {
    let index = index.as_u64().and_then(|index| usize::try_from(index).ok());
    let accessor = index.and_then(|index| document.accessors().nth(index));
    accessor.ok_or_else(|| Problem::new("has instances that name an accessor that does not exist", DAMAGED))
}
