//! Checked reading of glTF accessors. The `gltf` crate's iterators trust their ranges and panic on wrong ones, so
//! every range is proven here, in checked arithmetic, before one is made.

use std::path::Path;

use gltf::accessor::{DataType, Dimensions, Item, Iter};
use gltf::{Accessor, buffer};

use super::MAX_ELEMENTS;
use super::buffers::Buffers;
use crate::{Error, Result};

/// Most entries for each one that a sparse accessor without a view holds.
const MAX_ZEROS: usize = 1024;

/// Reads the accessors of one primitive.
pub(super) struct Reader<'a> {
    /// The model, for messages.
    pub name: &'a Path,
    /// The mesh and primitive, for messages.
    pub place: &'a str,
    /// The buffers' bytes.
    pub buffers: &'a Buffers,
}

impl Reader<'_> {
    /// Vertex positions: finite floats.
    pub fn positions(&self, accessor: Accessor) -> Result<Vec<[f32; 3]>> {
        self.expect(&accessor, "POSITION", &[DataType::F32], Dimensions::Vec3)?;
        let index = accessor.index();
        let values = self.read::<[f32; 3]>(accessor)?;
        self.finite(index, "POSITION", &values)?;
        Ok(values)
    }

    /// Vertex normals: finite floats, `count` of them.
    pub fn normals(&self, accessor: Accessor, count: usize) -> Result<Vec<[f32; 3]>> {
        self.expect(&accessor, "NORMAL", &[DataType::F32], Dimensions::Vec3)?;
        self.count(&accessor, "NORMAL", count)?;
        let index = accessor.index();
        let values = self.read::<[f32; 3]>(accessor)?;
        self.finite(index, "NORMAL", &values)?;
        Ok(values)
    }

    /// Texture coordinates: finite floats, or normalized bytes or shorts, `count` of them.
    pub fn uvs(&self, accessor: Accessor, count: usize) -> Result<Vec<[f32; 2]>> {
        self.expect(&accessor, "TEXCOORD", &[DataType::F32, DataType::U8, DataType::U16], Dimensions::Vec2)?;
        self.count(&accessor, "TEXCOORD", count)?;
        let (index, kind) = (accessor.index(), accessor.data_type());
        if kind != DataType::F32 && !accessor.normalized() {
            let what = "integer texture coordinates that are not normalized";
            return Err(self.error(index, what, "export float texture coordinates"));
        }
        let values = match kind {
            DataType::U8 => {
                self.read::<[u8; 2]>(accessor)?.iter().map(|v| v.map(|c| f32::from(c) / 255.0)).collect()
            }
            DataType::U16 => {
                self.read::<[u16; 2]>(accessor)?.iter().map(|v| v.map(|c| f32::from(c) / 65535.0)).collect()
            }
            _ => self.read::<[f32; 2]>(accessor)?,
        };
        self.finite(index, "TEXCOORD", &values)?;
        Ok(values)
    }

    /// Vertex indices, each under `vertices`.
    pub fn indices(&self, accessor: Accessor, vertices: usize) -> Result<Vec<u32>> {
        self.expect(&accessor, "indices", &[DataType::U8, DataType::U16, DataType::U32], Dimensions::Scalar)?;
        let index = accessor.index();
        let values: Vec<u32> = match accessor.data_type() {
            DataType::U8 => self.read::<u8>(accessor)?.into_iter().map(u32::from).collect(),
            DataType::U16 => self.read::<u16>(accessor)?.into_iter().map(u32::from).collect(),
            _ => self.read::<u32>(accessor)?,
        };
        match values.iter().position(|v| *v as usize >= vertices) {
            Some(i) => {
                let what = format!("index {i} is {}, but there are {vertices} vertices", values[i]);
                Err(self.error(index, what, "export the model again"))
            }
            None => Ok(values),
        }
    }

    fn error(&self, accessor: usize, what: impl Into<String>, remedy: &str) -> Error {
        Error::input(self.name, format!("{}, accessors[{accessor}]", self.place), what, remedy)
    }

    fn expect(&self, accessor: &Accessor, role: &str, types: &[DataType], shape: Dimensions) -> Result<()> {
        if types.contains(&accessor.data_type()) && accessor.dimensions() == shape {
            return Ok(());
        }
        let what = format!(
            "{role} is {:?} {:?}; {shape:?} of {types:?} is read",
            accessor.dimensions(),
            accessor.data_type()
        );
        let remedy = "export without quantization (KHR_mesh_quantization) or compression";
        Err(self.error(accessor.index(), what, remedy))
    }

    fn count(&self, accessor: &Accessor, role: &str, count: usize) -> Result<()> {
        if accessor.count() == count {
            return Ok(());
        }
        let what = format!("{role} has {} entries, but there are {count} positions", accessor.count());
        Err(self.error(accessor.index(), what, "export the model again"))
    }

    fn finite<const N: usize>(&self, accessor: usize, role: &str, values: &[[f32; N]]) -> Result<()> {
        match values.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            Some(i) => {
                let what = format!("{role} {i} is {:?}, not finite", values[i]);
                Err(self.error(accessor, what, "correct the model and export it again"))
            }
            None => Ok(()),
        }
    }

    /// That `count` items of `size` bytes lie within the view, and the view within its buffer.
    fn span(
        &self,
        accessor: usize,
        view: &buffer::View,
        offset: usize,
        count: usize,
        size: usize,
    ) -> Result<()> {
        let stride = view.stride().unwrap_or(size);
        let last = stride.checked_mul(count - 1);
        let end = last.and_then(|l| l.checked_add(offset)?.checked_add(size));
        let inside = end.is_some_and(|e| e <= view.length()) && self.buffers.view(view).is_some();
        if inside && stride >= size {
            return Ok(());
        }
        let view_index = view.index();
        let what = format!(
            "{count} items of {size} bytes from byte {offset}, {stride} bytes apart, leave bufferViews[{view_index}] or its buffer"
        );
        Err(self.error(accessor, what, "the file is damaged or truncated; export or copy it again"))
    }

    fn read<T: Item + Copy>(&self, accessor: Accessor) -> Result<Vec<T>> {
        let (index, count, size) = (accessor.index(), accessor.count(), size_of::<T>());
        if count == 0 || count > 3 * MAX_ELEMENTS {
            return Err(self.error(
                index,
                format!("the accessor has {count} entries"),
                "export the model again",
            ));
        }
        if let Some(view) = accessor.view() {
            self.span(index, &view, accessor.offset(), count, size)?;
        } else if accessor.sparse().is_none() {
            let remedy = "export without extensions that compress meshes";
            return Err(self.error(index, "the accessor has no bufferView", remedy));
        }
        if let Some(sparse) = accessor.sparse() {
            let replaced = sparse.count();
            if replaced == 0 || replaced > count {
                let what = format!("the accessor replaces {replaced} of its {count} entries");
                return Err(self.error(index, what, "export the model again"));
            }
            // Without a view the others are zeros that the file does not hold: any number of them, for a few bytes.
            if accessor.view().is_none() && count / MAX_ZEROS > replaced {
                let what =
                    format!("the accessor has no bufferView and only {replaced} of its {count} entries");
                return Err(self.error(index, what, "export the model again, without sparse accessors"));
            }
            let indices = sparse.indices();
            self.span(index, &indices.view(), indices.offset(), replaced, indices.index_type().size())?;
            self.span(index, &sparse.values().view(), sparse.values().offset(), replaced, size)?;
        }
        let items = Iter::<T>::new(accessor, |b| self.buffers.get(b.index()));
        let values: Vec<T> = items.into_iter().flatten().take(count).collect();
        if values.len() != count {
            let what = format!("{} of {count} entries could be read", values.len());
            return Err(self.error(index, what, "export the model again"));
        }
        Ok(values)
    }
}
