//! Storage of the BRDF models in streams. Each model is listed once with its columns.

use super::stream::{Fill, ModelStream, Own};
use crate::bsdf::{self, Brdf, Microfacets};
use crate::lane::Lane;
use crate::math::Vec3;

/// A BRDF model. Points of each model have their own stream.
pub trait Model: Sized {
    /// The BRDF at the points of a packet.
    type Of<L: Lane>: Brdf<L>;
    /// Number of columns besides the normal and the reflectance.
    const COLUMNS: usize;
    /// Writes the model's columns.
    fn put<L: Lane>(bsdf: &Self::Of<L>, columns: &mut Fill<L>);
    /// Builds the BRDF from a normal, a reflectance and the model's columns.
    fn get<L: Lane>(n: Vec3<L>, rho: Vec3<L>, columns: &Own) -> Self::Of<L>;
    /// The model's stream, if it has points.
    fn stream(streams: &Streams) -> Option<&ModelStream<Self>>;
    /// The model's stream, mutable, if it has points.
    fn stream_mut(streams: &mut Streams) -> Option<&mut ModelStream<Self>>;
    /// The model's stream, to be filled; allocated on the first call.
    fn filled(streams: &mut Streams) -> &mut ModelStream<Self>;
}

/// Declares the models: type, stream name, number of columns.
macro_rules! models {
    ($($(#[$doc:meta])* $model:ident: $stream:ident, $columns:literal;)*) => {
        $($(#[$doc])* #[derive(Debug)] pub struct $model;)*

        /// Shading points, grouped by model. A stream is allocated when it is first filled, so that an absent model costs no memory: a
        /// stream takes half a megabyte, which is filled with zeros.
        #[derive(Debug, Default)]
        pub struct Streams {
            $($stream: Option<ModelStream<$model>>,)*
        }

        impl Streams {
            /// Empties all streams.
            pub fn clear(&mut self) {
                $(self.$stream.iter_mut().for_each(|stream| stream.clear());)*
            }

            /// See [`ModelStream::pad`].
            pub fn pad(&mut self) {
                $(self.$stream.iter_mut().for_each(ModelStream::pad);)*
            }
        }

        $(impl Model for $model {
            type Of<L: Lane> = bsdf::$model<L>;
            const COLUMNS: usize = $columns;
            #[inline(always)]
            fn put<L: Lane>(bsdf: &Self::Of<L>, columns: &mut Fill<L>) {
                $stream::put(bsdf, columns);
            }
            #[inline(always)]
            fn get<L: Lane>(n: Vec3<L>, rho: Vec3<L>, columns: &Own) -> Self::Of<L> {
                $stream::get(n, rho, columns)
            }
            fn stream(streams: &Streams) -> Option<&ModelStream<Self>> {
                streams.$stream.as_ref().filter(|stream| stream.len() > 0)
            }
            fn stream_mut(streams: &mut Streams) -> Option<&mut ModelStream<Self>> {
                streams.$stream.as_mut().filter(|stream| stream.len() > 0)
            }
            #[inline(always)]
            fn filled(streams: &mut Streams) -> &mut ModelStream<Self> {
                streams.$stream.get_or_insert_with(ModelStream::new)
            }
        })*
    };
}

models! {
    /// Lambert's model.
    Diffuse: diffuse, 0;
    /// Phong's model.
    Phong: phong, 5;
    /// The metallic-roughness model: rough metals, and diffuse bodies below a rough dielectric coat.
    Ggx: ggx, 5;
    /// Metals defined by their complex index of refraction.
    Conductor: conductor, 10;
}

mod diffuse {
    use super::*;

    #[inline(always)]
    pub fn put<L: Lane>(_: &bsdf::Diffuse<L>, _: &mut Fill<L>) {}

    #[inline(always)]
    pub fn get<L: Lane>(n: Vec3<L>, rho: Vec3<L>, _: &Own) -> bsdf::Diffuse<L> {
        bsdf::Diffuse { n, rho }
    }
}

mod phong {
    use super::*;

    const MIRROR: usize = 0;
    const EXPONENT: usize = 3;
    const REACH: usize = 4;

    #[inline(always)]
    pub fn put<L: Lane>(bsdf: &bsdf::Phong<L>, columns: &mut Fill<L>) {
        columns.put3(MIRROR, bsdf.wr);
        columns.put(EXPONENT, bsdf.alpha);
        columns.put(REACH, bsdf.reach);
    }

    #[inline(always)]
    pub fn get<L: Lane>(n: Vec3<L>, rho: Vec3<L>, columns: &Own) -> bsdf::Phong<L> {
        bsdf::Phong {
            n,
            wr: columns.get3(MIRROR),
            rho,
            alpha: columns.get(EXPONENT),
            reach: columns.get(REACH),
        }
    }
}

/// Columns shared by microfacet models; they come first.
mod facets {
    use super::*;

    const SEEN_FROM: usize = 0;
    const ROUGHNESS: usize = 3;
    pub const COUNT: usize = 4;

    #[inline(always)]
    pub fn put<L: Lane>(facets: &Microfacets<L>, columns: &mut Fill<L>) {
        columns.put3(SEEN_FROM, facets.wo);
        columns.put(ROUGHNESS, facets.alpha);
    }

    #[inline(always)]
    pub fn get<L: Lane>(n: Vec3<L>, columns: &Own) -> Microfacets<L> {
        Microfacets {
            n,
            wo: columns.get3(SEEN_FROM),
            alpha: columns.get(ROUGHNESS),
        }
    }
}

mod ggx {
    use super::*;

    const METALLIC: usize = facets::COUNT;

    #[inline(always)]
    pub fn put<L: Lane>(bsdf: &bsdf::Ggx<L>, columns: &mut Fill<L>) {
        facets::put(&bsdf.facets, columns);
        columns.put(METALLIC, bsdf.metallic);
    }

    #[inline(always)]
    pub fn get<L: Lane>(n: Vec3<L>, rho: Vec3<L>, columns: &Own) -> bsdf::Ggx<L> {
        bsdf::Ggx {
            facets: facets::get(n, columns),
            rho,
            metallic: columns.get(METALLIC),
        }
    }
}

mod conductor {
    use super::*;

    const ETA: usize = facets::COUNT;
    const K: usize = ETA + 3;

    #[inline(always)]
    pub fn put<L: Lane>(bsdf: &bsdf::Conductor<L>, columns: &mut Fill<L>) {
        facets::put(&bsdf.facets, columns);
        columns.put3(ETA, bsdf.eta);
        columns.put3(K, bsdf.k);
    }

    #[inline(always)]
    pub fn get<L: Lane>(n: Vec3<L>, rho: Vec3<L>, columns: &Own) -> bsdf::Conductor<L> {
        bsdf::Conductor {
            facets: facets::get(n, columns),
            rho,
            eta: columns.get3(ETA),
            k: columns.get3(K),
        }
    }
}
