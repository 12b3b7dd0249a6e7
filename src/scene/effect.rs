//! Effects that a scene may require, each of which a kernel includes or not.

use serde::Serialize;

/// One effect. Its index in this list is its bit in [`Effects`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Effect {
    /// Lambert's model.
    Diffuse,
    /// Phong's model.
    Phong,
    /// Both lobes in one material.
    Blend,
    /// Materials whose back reflects nothing.
    OneSided,
    /// Spheres that reflect.
    Spheres,
    /// Meshes that reflect.
    Meshes,
    /// Normals interpolated over triangles.
    SmoothNormals,
    /// Pictures on surfaces.
    Textures,
    /// A lens, and so a depth of field.
    Lens,
    /// Spheres that emit.
    SphereLights,
    /// Meshes that emit.
    MeshLights,
    /// Light from beyond the scene.
    Environment,
    /// Meshes that are lit as if they were as smooth as their normals.
    SmoothTerminator,
    /// More lights than a pass samples one by one.
    ManyLights,
    /// Metals and coated bodies with rough surfaces.
    Ggx,
    /// Metals by their index of refraction.
    Conductor,
    /// Points, spots and lights from one direction.
    DeltaLights,
    /// Disks of light in the sky.
    Suns,
}

impl Effect {
    /// All of them.
    pub const ALL: [Self; 18] = [
        Self::Diffuse,
        Self::Phong,
        Self::Blend,
        Self::OneSided,
        Self::Spheres,
        Self::Meshes,
        Self::SmoothNormals,
        Self::Textures,
        Self::Lens,
        Self::SphereLights,
        Self::MeshLights,
        Self::Environment,
        Self::SmoothTerminator,
        Self::ManyLights,
        Self::Ggx,
        Self::Conductor,
        Self::DeltaLights,
        Self::Suns,
    ];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Diffuse => "diffuse",
            Self::Phong => "phong",
            Self::Blend => "blend",
            Self::OneSided => "one-sided",
            Self::Spheres => "spheres",
            Self::Meshes => "meshes",
            Self::SmoothNormals => "smooth normals",
            Self::Textures => "textures",
            Self::Lens => "lens",
            Self::SphereLights => "sphere lights",
            Self::MeshLights => "mesh lights",
            Self::Environment => "environment",
            Self::SmoothTerminator => "smooth terminator",
            Self::ManyLights => "many lights",
            Self::Ggx => "ggx",
            Self::Conductor => "conductor",
            Self::DeltaLights => "delta lights",
            Self::Suns => "suns",
        }
    }
}

/// A set of effects. Its bits are the const parameter that stages are compiled for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Effects(u32);

impl Effects {
    /// The set of these.
    pub const fn of(effects: &[Effect]) -> Self {
        let (mut bits, mut i) = (0, 0);
        while i < effects.len() {
            bits |= 1 << effects[i] as u32;
            i += 1;
        }
        Self(bits)
    }

    /// The set with these bits.
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// One bit for each effect.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Whether the effect is in the set.
    pub const fn has(self, effect: Effect) -> bool {
        self.0 & (1 << effect as u32) != 0
    }

    /// Whether all of `others` are in the set.
    pub const fn contains(self, others: Self) -> bool {
        self.0 & others.0 == others.0
    }

    /// The union of both sets.
    pub const fn union(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// The effects that are not in the other set.
    pub const fn difference(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// The effects in both sets.
    pub const fn intersection(self, others: Self) -> Self {
        Self(self.0 & others.0)
    }

    /// The set, with `effect` added if `there`.
    pub const fn with(self, effect: Effect, there: bool) -> Self {
        Self(self.0 | (there as u32) << effect as u32)
    }

    /// The effects in the order of [`Effect::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.into_iter().filter(move |&effect| self.has(effect))
    }

    /// Their names.
    pub fn names(self) -> Vec<&'static str> {
        self.iter().map(Effect::name).collect()
    }
}
