//! Textures in lanes.

use crate::lane::Lane;
use crate::math::Vec3;
use crate::scene::{Texture, Wrap};

/// Texture coordinates of a mesh and the picture on it.
#[derive(Debug)]
pub struct Textured {
    /// Corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Coordinates of the vertices.
    pub uvs: Vec<[f32; 2]>,
    /// The picture.
    pub texture: std::sync::Arc<Texture>,
}

/// Four texels around a point of each lane, and how far between them it lies. A lane without a texture shows 1.
pub struct Fetched {
    texels: [[[f32; 16]; 3]; 4],
    x: [f32; 16],
    y: [f32; 16],
}

impl Default for Fetched {
    fn default() -> Self {
        Self {
            texels: [[[1.0; 16]; 3]; 4],
            x: [0.0; 16],
            y: [0.0; 16],
        }
    }
}

impl Fetched {
    /// Fetches for a lane: the point with the weights `(b, c)` of the second and third corner of a triangle.
    pub fn fetch(&mut self, lane: usize, on: &Textured, triangle: u32, (b, c): (f32, f32)) {
        let [p, q, r] = on.triangles[triangle as usize].map(|corner| on.uvs[corner as usize]);
        let a = 1.0 - b - c;
        let [u, v] = std::array::from_fn(|k| a * p[k] + b * q[k] + c * r[k]);
        let Texture {
            width, height, wrap, ..
        } = *on.texture;
        let (columns, x) = around(u, width, wrap);
        let (rows, y) = around(1.0 - v, height, wrap);
        (self.x[lane], self.y[lane]) = (x, y);
        for (corner, texel) in self.texels.iter_mut().enumerate() {
            let at = rows[corner / 2] as usize * width as usize + columns[corner % 2] as usize;
            for (k, channel) in texel.iter_mut().enumerate() {
                channel[lane] = on.texture.texels[at][k];
            }
        }
    }

    /// The bilinear means.
    #[inline(always)]
    pub fn mean<L: Lane>(&self) -> Vec3<L> {
        let (x, y) = (L::load(&self.x), L::load(&self.y));
        Vec3::new(self.channel(0, x, y), self.channel(1, x, y), self.channel(2, x, y))
    }

    #[inline(always)]
    fn channel<L: Lane>(&self, k: usize, x: L, y: L) -> L {
        let [a, b, c, d] = [0, 1, 2, 3].map(|corner: usize| &self.texels[corner][k]);
        let (a, b, c, d) = (L::load(a), L::load(b), L::load(c), L::load(d));
        let (top, bottom) = ((b - a).mul_add(x, a), (d - c).mul_add(x, c));
        (bottom - top).mul_add(y, top)
    }
}

/// The two texels of a row around the coordinate `s`, and how far behind the first one's middle it is, in [0, 1].
fn around(s: f32, size: u32, wrap: Wrap) -> ([u32; 2], f32) {
    let n = size as f32;
    match wrap {
        Wrap::Repeat => {
            // Into the unit square first: what is left of large coordinates is exact.
            let at = (s - s.floor()) * n - 0.5;
            let first = at.floor();
            let second = (first + 1.0).max(0.0) as u32 % size;
            let first_texel = if first < 0.0 {
                size - 1
            } else {
                (first as u32).min(size - 1)
            };
            ([first_texel, second], at - first)
        }
        Wrap::Clamp => {
            let at = (s.clamp(0.0, 1.0) * n - 0.5).clamp(0.0, n - 1.0);
            let first = at.floor();
            let texel = first as u32;
            ([texel, (texel + 1).min(size - 1)], at - first)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middles_have_their_own_texel_and_edges_are_wrapped() {
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            for i in 0..5 {
                let (texels, part) = around((i as f32 + 0.5) / 5.0, 5, wrap);
                let near = if part < 0.5 { texels[0] } else { texels[1] };
                assert_eq!(near, i, "{wrap:?}");
                assert!(part.min(1.0 - part) < 1e-6);
            }
        }
        assert_eq!(around(0.0, 4, Wrap::Repeat), ([3, 0], 0.5));
        assert_eq!(around(1.0, 4, Wrap::Clamp).0[0], 3);
        assert_eq!(around(-7.0, 4, Wrap::Clamp), ([0, 1], 0.0));
        let ((a, x), (b, y)) = (around(0.375, 4, Wrap::Repeat), around(-2.625, 4, Wrap::Repeat));
        assert_eq!((a, x), (b, y));
        assert_eq!(around(0.999_999_94, 1, Wrap::Repeat).0, [0, 0]);
    }
}
