//! Arguments that choose the lattice, and what there is to say of it.

use super::args::{Point, Preview, above_zero, point, value_name};
use unweld::encoder::{LatticeChoice, Options, Report};
use unweld::mesh::Lattice;

/// Which lattice the coordinates live on.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Lattice")]
pub struct Choice {
    /// Bits a coordinate, 8 to 24; auto:STEP: the fewest whose step is at most STEP, in the units of the mesh
    #[arg(long, value_name = "N|auto:STEP", default_value = "14", value_parser = bits)]
    position_bits: Bits,
    /// The step, above 0, of a lattice that meshes share which touch, such as tiles of a map; the bits, 8 to 24, follow from the extent.
    /// With a power of two, such as 0.0009765625, common vertices are bit-equal at level 0; with --lock-boundary at every level
    #[arg(long, value_name = "S", value_parser = above_zero, conflicts_with = "position_bits")]
    lattice_step: Option<f64>,
    /// A point of that lattice; 0,0,0 where not given. With multiples of the step nothing is rounded
    #[arg(long, value_name = "X,Y,Z", value_parser = point, requires = "lattice_step", allow_hyphen_values = true)]
    lattice_origin: Option<Point>,
}

/// Bits a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bits {
    Fixed(u32),
    AtMost(f64),
}

impl Choice {
    /// For the library: bits, and which lattice.
    pub fn of_library(&self) -> (u32, LatticeChoice) {
        let default = Options::default().position_bits;
        match (self.lattice_step, self.position_bits) {
            (Some(step), _) => {
                let origin = self.lattice_origin.map_or([0.0; 3], |point| point.0);
                (default, LatticeChoice::Given { step, origin })
            }
            (None, Bits::AtMost(step)) => (default, LatticeChoice::AtMost(step)),
            (None, Bits::Fixed(bits)) => (bits, LatticeChoice::Bits),
        }
    }

    /// Names and values, as they are given.
    pub fn settings(&self) -> Vec<(String, String)> {
        let bits = match self.position_bits {
            Bits::Fixed(bits) => bits.to_string(),
            Bits::AtMost(step) => format!("auto:{step}"),
        };
        let step = self.lattice_step.map(|step| ("lattice-step", step.to_string()));
        let origin = self.lattice_origin.map(|Point([x, y, z])| ("lattice-origin", format!("{x},{y},{z}")));
        let settings = [Some(("position-bits", bits)), step, origin].into_iter().flatten();
        settings.map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// What keeps neighbours on a given lattice from being equal.
    pub fn warnings(&self, preview: Preview, report: &Report) -> Vec<String> {
        let Some(step) = self.lattice_step else { return Vec::new() };
        let mut warnings = Vec::new();
        if !report.lattice_is_exact {
            let power = power_of_two(step);
            warnings.push(format!(
                "the points of the lattice are rounded: vertices of neighbours can differ in their last bits; not so \
                 with a step that is a power of two, such as {power}, and an origin of multiples of it",
            ));
        }
        if let Preview::Fine | Preview::Coarse = preview {
            warnings.push(format!(
                "--preview {} makes lattices of their own for coarse levels: neighbours share level 0 alone",
                value_name(&preview),
            ));
        }
        warnings
    }
}

/// The largest power of two that is not above `step`, which is a normal number, as short as it can be told.
fn power_of_two(step: f64) -> String {
    let power = f64::from_bits(step.to_bits() >> 52 << 52);
    if power >= 1e-5 { power.to_string() } else { format!("2^{:.0}", power.log2()) }
}

/// `14` or `auto:0.001`.
fn bits(text: &str) -> Result<Bits, String> {
    let (min, max) = (Lattice::MIN_BITS, Lattice::MAX_BITS);
    let found = match text.strip_prefix("auto:") {
        Some(number) => above_zero(number).ok().map(Bits::AtMost),
        None => text.parse().ok().filter(|bits| (min..=max).contains(bits)).map(Bits::Fixed),
    };
    found.ok_or_else(|| {
        format!("a number from {min} to {max}, or auto: and a step above 0, such as auto:0.001")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_of_bits() {
        assert_eq!(bits("8"), Ok(Bits::Fixed(8)));
        assert_eq!(bits("auto:0.25"), Ok(Bits::AtMost(0.25)));
        for text in
            ["", "7", "25", "-9", "12.5", "auto", "auto:", "auto:0", "auto:-1", "auto:nan", "auto:inf"]
        {
            assert!(bits(text).is_err(), "{text}");
        }
    }

    #[test]
    fn origins() {
        assert_eq!(point("1,-2.5, 3e2"), Ok(Point([1.0, -2.5, 300.0])));
        for text in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,inf", "1;2;3"] {
            assert!(point(text).is_err(), "{text}");
        }
    }

    #[test]
    fn powers_below_a_step() {
        // 2^-10 is the largest below a thousandth; 2^-20 is just below a millionth.
        let told = [(0.001, "0.0009765625"), (0.5, "0.5"), (3.0, "2"), (1e-6, "2^-20")];
        for (step, power) in told {
            assert_eq!(power_of_two(step), power);
        }
    }
}
