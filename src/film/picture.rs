//! A finished picture in memory.

/// Linear RGB radiance, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` triples, row by row.
    pub pixels: Vec<[f32; 3]>,
}
