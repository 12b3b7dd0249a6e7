//! Converts from the primaries of a file to Rec. 709, the colour space of scenes.

use glam::{DMat3, DVec3};

/// Chromaticities (CIE 1931 x, y) of red, green, blue and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Primaries {
    pub red: [f64; 2],
    pub green: [f64; 2],
    pub blue: [f64; 2],
    pub white: [f64; 2],
}

/// ITU-R BT.709-6, table 1; its white is D65.
pub(super) const REC_709: Primaries = Primaries {
    red: [0.64, 0.33],
    green: [0.30, 0.60],
    blue: [0.15, 0.06],
    white: [0.3127, 0.3290],
};

/// The axes of CIE XYZ, which is absolute and not relative to a white point.
pub(super) const XYZ: Primaries = Primaries {
    red: [1.0, 0.0],
    green: [0.0, 1.0],
    blue: [0.0, 0.0],
    white: [1.0 / 3.0, 1.0 / 3.0],
};

/// Tolerance of chromaticities, which files round.
const SAME: f64 = 1e-3;

/// Long, medium and short cones of Bradford's transform (Lam 1985; the numbers of ICC.1:2022, annex E.3), column by column.
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);

impl Primaries {
    /// Whether both are the same, within the tolerance of files.
    pub fn are(&self, other: &Self) -> bool {
        let all = |p: &Self| [p.red, p.green, p.blue, p.white].concat();
        all(self).iter().zip(all(other)).all(|(a, b)| (a - b).abs() < SAME)
    }

    /// From RGB to CIE XYZ; (1, 1, 1) is white with luminance 1. `None` for invalid primaries.
    pub fn to_xyz(self) -> Option<DMat3> {
        let xyz = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y);
        let axes = DMat3::from_cols(xyz(self.red), xyz(self.green), xyz(self.blue));
        let white = xyz(self.white) / self.white[1];
        let shares = axes.inverse() * white;
        let sound = axes.determinant().abs() > 1e-6 && white.is_finite() && shares.is_finite();
        (sound && self.white[1] > 0.0).then(|| axes * DMat3::from_diagonal(shares))
    }

    /// From RGB of these primaries to that of Rec. 709. Bradford's adaptation keeps white white; `neutral` is the file's white
    /// if it differs from the white point of its primaries. CIE XYZ is converted without adaptation. `None` for invalid
    /// primaries.
    pub fn to_rec_709(self, neutral: Option<[f64; 2]>) -> Option<DMat3> {
        let from_xyz = REC_709.to_xyz()?.inverse();
        let to_xyz = self.to_xyz()?;
        let axes = |p: &Self| Self { white: XYZ.white, ..*p };
        if axes(&self).are(&XYZ) {
            return Some(from_xyz * to_xyz);
        }
        let cones = |[x, y]: [f64; 2]| BRADFORD * DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        let gains = cones(REC_709.white) / cones(neutral.unwrap_or(self.white));
        let adapted = BRADFORD.inverse() * DMat3::from_diagonal(gains) * BRADFORD;
        gains.is_finite().then(|| from_xyz * adapted * to_xyz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: DVec3, b: [f64; 3], tolerance: f64) {
        assert!(
            (a - DVec3::from_array(b)).abs().max_element() < tolerance,
            "{a} is not {b:?}"
        );
    }

    /// IEC 61966-2-1 prints the matrix of Rec. 709 to four digits; ACES (S-2014-004) that of AP1, with Bradford's adaptation.
    #[test]
    fn matrices_are_those_of_the_standards() {
        let rec_709 = REC_709.to_xyz().unwrap();
        close(rec_709.x_axis, [0.4124, 0.2126, 0.0193], 6e-5);
        close(rec_709.y_axis, [0.3576, 0.7152, 0.1192], 6e-5);
        close(rec_709.z_axis, [0.1805, 0.0722, 0.9505], 6e-5);
        let ap1 = Primaries {
            red: [0.713, 0.293],
            green: [0.165, 0.830],
            blue: [0.128, 0.044],
            white: [0.32168, 0.33767],
        };
        let converted = ap1.to_rec_709(None).unwrap();
        close(converted.x_axis, [1.705_05, -0.130_26, -0.024_00], 1e-4);
        close(converted.y_axis, [-0.621_79, 1.140_80, -0.128_97], 1e-4);
        close(converted.z_axis, [-0.083_26, -0.010_55, 1.152_97], 1e-4);
        close(converted * DVec3::ONE, [1.0; 3], 1e-12);
    }

    #[test]
    fn measured_numbers_are_not_adapted() {
        let white_of_d65 = REC_709.to_xyz().unwrap() * DVec3::ONE;
        close(XYZ.to_rec_709(None).unwrap() * white_of_d65, [1.0; 3], 1e-12);
    }

    #[test]
    fn what_is_no_colour_has_no_matrix() {
        let same = Primaries {
            green: REC_709.red,
            ..REC_709
        };
        let dark = Primaries {
            white: [0.3, 0.0],
            ..REC_709
        };
        let nan = Primaries {
            blue: [f64::NAN; 2],
            ..REC_709
        };
        assert!([same, dark, nan].iter().all(|p| p.to_rec_709(None).is_none()));
    }
}
