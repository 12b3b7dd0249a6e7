//! Texture lookups for packets.

use std::sync::Arc;

use glam::DVec2;

use crate::lane::Lane;
use crate::math::Vec3;
use crate::math::elementary::angle;
use crate::scene::{Texture, Wrap};

/// Texture coordinates of a mesh, and its texture.
#[derive(Debug)]
pub struct Textured {
    /// Coordinates at the vertices of each triangle.
    triangles: Vec<[[f32; 2]; 3]>,
    /// The texture.
    texture: Arc<Texture>,
}

impl Textured {
    /// A texture on triangles, whose vertices index `uvs`.
    pub fn new(triangles: &[[u32; 3]], uvs: &[DVec2], texture: Arc<Texture>) -> Self {
        let corners = |triangle: &[u32; 3]| triangle.map(|i| uvs[i as usize]);
        let rounded = |corners: [DVec2; 3]| corners.map(|uv| uv.to_array().map(|x| x as f32));
        let triangles = match texture.wrap {
            Wrap::Repeat => triangles.iter().map(|t| rounded(near_zero(corners(t)))).collect(),
            Wrap::Clamp => triangles.iter().map(|t| rounded(corners(t))).collect(),
        };
        Self { triangles, texture }
    }
}

/// Subtracts whole numbers from the coordinates of a triangle, the same for its three vertices, to bring them as close to 0 as
/// possible. A repeating texture looks the same, and coordinates of 1e7 keep their digits in `f32`. Triangles that cross 0 stay
/// unchanged.
fn near_zero(corners: [DVec2; 3]) -> [DVec2; 3] {
    let [a, b, c] = corners;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    // One of the two terms is 0.
    let whole = low.floor().max(DVec2::ZERO) + high.ceil().min(DVec2::ZERO);
    corners.map(|uv| uv - whole)
}

/// The four texels around each lane's point and the interpolation weights. A lane without a texture gets 1.
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
    /// Fetches the texels of a lane at the point with barycentric weights `(b, c)` of the second and third vertex.
    pub fn fetch(&mut self, lane: usize, on: &Textured, triangle: u32, (b, c): (f32, f32)) {
        let [p, q, r] = on.triangles[triangle as usize];
        let a = 1.0 - b - c;
        let [u, v] = std::array::from_fn(|k| a * p[k] + b * q[k] + c * r[k]);
        let Texture {
            width, height, wrap, ..
        } = *on.texture;
        let columns = around(u, width, wrap);
        self.take(lane, &on.texture, columns, around(1.0 - v, height, wrap));
    }

    /// Fetches the texels of a lane on a sphere, at the outward normal `n` of any length. Columns wrap around and rows clamp at the
    /// poles, whatever the wrap mode of the texture.
    pub fn fetch_on_sphere(&mut self, lane: usize, texture: &Texture, n: [f32; 3]) {
        let [x, y, z] = n;
        // Scaled to about 1: squares of tiny components would underflow to 0.
        let size = x.abs().max(y.abs()).max(z.abs()).max(f32::MIN_POSITIVE);
        let [x, y, z] = [x / size, y / size, z / size];
        let longitude = angle::<f32>(x.abs(), z).copysign(x);
        let from_top = angle::<f32>((x * x + z * z).sqrt(), y);
        let columns = around(0.5 + longitude / std::f32::consts::TAU, texture.width, Wrap::Repeat);
        let rows = around(from_top / std::f32::consts::PI, texture.height, Wrap::Clamp);
        self.take(lane, texture, columns, rows);
    }

    /// Fetches the four texels at two columns and two rows.
    fn take(&mut self, lane: usize, texture: &Texture, (columns, x): ([u32; 2], f32), (rows, y): ([u32; 2], f32)) {
        (self.x[lane], self.y[lane]) = (x, y);
        for (corner, texel) in self.texels.iter_mut().enumerate() {
            let at = rows[corner / 2] as usize * texture.width as usize + columns[corner % 2] as usize;
            for (channel, x) in texel.iter_mut().zip(texture.texels.at(at)) {
                channel[lane] = x;
            }
        }
    }

    /// The bilinearly interpolated values.
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

/// The two texels of a row around the coordinate `s`, and the distance from the first one's center, in [0, 1].
fn around(s: f32, size: u32, wrap: Wrap) -> ([u32; 2], f32) {
    let n = size as f32;
    match wrap {
        Wrap::Repeat => {
            // Reduced to the unit interval first: the fraction of a large coordinate is exact.
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
    use crate::texels::Texels;

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

    /// Whole numbers are subtracted per triangle: the same place on the texture has the same coordinates, to the last bit.
    #[test]
    fn whole_numbers_come_off_before_rounding() {
        let base = [[0.25, 0.5], [6.25, 0.5], [6.125, 6.75]].map(DVec2::from_array);
        let texture = |wrap| {
            Arc::new(Texture {
                width: 1,
                height: 1,
                texels: Texels::Single(vec![[1.0; 3]]),
                wrap,
            })
        };
        let of = |by: DVec2, wrap| Textured::new(&[[0, 1, 2]], &base.map(|uv| uv + by), texture(wrap)).triangles[0];
        let here = base.map(|uv| uv.to_array().map(|x| x as f32));
        for by in [0.0, 1.0, 1e6, 1e7, 1e9] {
            assert_eq!(of(DVec2::splat(by), Wrap::Repeat), here, "{by}");
            assert_eq!(of(DVec2::new(by, 0.0), Wrap::Repeat), here, "{by}");
            // Negative coordinates end just below 0.
            let below = of(DVec2::splat(-by - 7.0), Wrap::Repeat);
            assert_eq!(below, here.map(|[u, v]| [u - 7.0, v - 7.0]), "-{by}");
        }
        assert_eq!(of(DVec2::splat(-3.0), Wrap::Repeat)[0], [-2.75, -2.5], "it crosses 0");
        assert_eq!(of(DVec2::splat(1e7), Wrap::Clamp)[1][0], 10_000_006.0);
    }
}
