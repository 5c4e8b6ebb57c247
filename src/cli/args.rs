//! Arguments that several commands share, and how their values are read.

use clap::ValueEnum;
use std::path::Path;
use unweld::container::Measure;
use unweld::encoder::{self, Keyframes};
use unweld::mesh::topology::Weld;
use unweld::simplify;

/// How the next vertex is chosen.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Method {
    /// `ffc`; `stellar` at levels that take rows, unless corners have values
    Auto,
    /// The best of some random vertices
    Stellar,
    /// The best of all, by a priority queue
    Ffc,
}

/// What matters most.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Profile {
    /// For who shows a mesh while it loads and keeps all of it: small, with good levels
    Default,
    /// For archives and slow lines: the fewest bytes in all, decoded more slowly
    Small,
    /// For who keeps to coarse levels: these are nearer to the original, the whole file is larger
    Fine,
}

impl Profile {
    /// For the library.
    pub fn of_library(self) -> encoder::Profile {
        match self {
            Self::Default => encoder::Profile::Default,
            Self::Small => encoder::Profile::Small,
            Self::Fine => encoder::Profile::Fine,
        }
    }
}

/// How coarse the coordinates of coarse levels are.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Preview {
    /// Fine, but off where tiles are to fit: with --lattice-step or --lock-boundary
    Auto,
    /// All levels have all bits
    Off,
    /// Fewer bits at first, no coarser than a level's error: the first kilobytes show more triangles
    Fine,
    /// Twice as coarse: still more at first, the file is larger by some percent
    Coarse,
}

impl Preview {
    /// For the library.
    pub fn of_library(self) -> encoder::Preview {
        match self {
            Self::Auto => encoder::Preview::Auto,
            Self::Off => encoder::Preview::Off,
            Self::Fine => encoder::Preview::Fine,
            Self::Coarse => encoder::Preview::Coarse,
        }
    }
}

/// How to simplify to a history.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Simplification")]
pub struct Simplification {
    /// How the next vertex to remove is chosen
    #[arg(long, value_enum, default_value = "auto")]
    pub method: Method,
    #[command(flatten)]
    pub removal: Removal,
}

/// How vertices are removed.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Simplification")]
pub struct Removal {
    /// Weight of the distance from the surface, 0 or more; 0.75 where not given
    #[arg(long, value_name = "A", value_parser = weight)]
    pub alpha: Option<f64>,
    /// Weight of the shape of the triangles, 0 or more; 0.02 where not given
    #[arg(long, value_name = "B", value_parser = weight)]
    pub beta: Option<f64>,
    /// Random vertices that `stellar` compares, or edges that `mca` does, 1 or more
    #[arg(long, value_name = "D", default_value_t = simplify::Options::default().choices,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub choices: u32,
    /// Keep every vertex of the boundary
    #[arg(long)]
    pub lock_boundary: bool,
    /// Which vertices of the input are one: exact, those with equal coordinates; none; lattice, those that the lattice rounds to
    /// one point (of 14 bits without a file); or those within a distance, in the units of the mesh, and whoever follows from that
    #[arg(long, value_name = "exact|none|lattice|DISTANCE", default_value = "exact", value_parser = weld)]
    pub weld: Weld,
    /// Seed of the random choices, 0 to 2^64 - 1
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
}

impl Removal {
    /// For the library; `profile` settles what has no argument of its own.
    pub fn options(
        &self,
        method: Method,
        profile: encoder::Profile,
        base_vertices: Option<usize>,
    ) -> simplify::Options {
        let profile = profile.simplify();
        simplify::Options {
            method: match method {
                Method::Auto => simplify::Method::Auto,
                Method::Stellar => simplify::Method::Stellar,
                Method::Ffc => simplify::Method::Ffc,
            },
            alpha: self.alpha.unwrap_or(profile.alpha),
            beta: self.beta.unwrap_or(profile.beta),
            choices: self.choices,
            base_vertices,
            seed: self.seed,
            ..profile
        }
    }
}

impl Simplification {
    /// Names and values, as they are given.
    pub fn settings(&self) -> Vec<(String, String)> {
        let named = |name: &str, value: String| (name.to_owned(), value);
        let removal = &self.removal;
        let weights = [("alpha", removal.alpha), ("beta", removal.beta)];
        let given = weights.into_iter().filter_map(|(name, w)| Some(named(name, w?.to_string())));
        let mut settings: Vec<_> = given.collect();
        settings.extend([
            named("method", value_name(&self.method)),
            named("choices", removal.choices.to_string()),
            named("lock-boundary", removal.lock_boundary.to_string()),
            named("weld", removal.weld.to_string()),
            named("seed", removal.seed.to_string()),
        ]);
        settings
    }
}

/// A point in the units of the mesh. (A list of numbers would be several values.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point(pub [f64; 3]);

/// A finite number above 0.
pub fn above_zero(text: &str) -> Result<f64, String> {
    let found = text.trim().parse().ok().filter(|step: &f64| step.is_finite() && *step > 0.0);
    found.ok_or_else(|| "a number above 0".to_owned())
}

/// Three finite numbers.
pub fn point(text: &str) -> Result<Point, String> {
    let numbers = text.split(',').map(|number| number.trim().parse().ok().filter(|x: &f64| x.is_finite()));
    let numbers: Option<Vec<f64>> = numbers.collect();
    let point = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    point.map(Point).ok_or_else(|| "three numbers such as 500000,0,-2.5".to_owned())
}

/// Whether a path stands for standard input or output.
pub fn is_stream(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// How far a mesh may be from the original.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// In the units of the mesh.
    Absolute(f64),
    /// In percent of the diagonal of the bounding box.
    Percent(f64),
}

/// `0.01` or `0.5%`.
pub fn tolerance(text: &str) -> Result<Tolerance, String> {
    let (number, kind): (_, fn(f64) -> Tolerance) = match text.strip_suffix('%') {
        Some(number) => (number.trim_end(), Tolerance::Percent),
        None => (text, Tolerance::Absolute),
    };
    match number.parse::<f64>() {
        Ok(x) if x >= 0.0 && x.is_finite() => Ok(kind(x)),
        _ => Err("a length such as 0.01, or a part of the diagonal such as 0.5%".to_owned()),
    }
}

/// The error that a level may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Which of its errors.
    pub measure: Measure,
    /// How large that may be.
    pub most: Tolerance,
}

/// A tolerance of the largest error, or with `rms:` before it, of the root mean square.
pub fn bound(text: &str) -> Result<Bound, String> {
    let (measure, most) = match text.split_once(':') {
        Some(("rms", most)) => (Measure::Rms, most),
        Some(("max", most)) => (Measure::Max, most),
        _ => (Measure::default(), text),
    };
    let most =
        tolerance(most).map_err(|what| format!("{what}, with rms: before it for the root mean square"))?;
    Ok(Bound { measure, most })
}

/// A part of a whole, above 0 and at most 1: `0.1` or `10%`.
pub fn part(text: &str) -> Result<f64, String> {
    let (number, whole) = text.strip_suffix('%').map_or((text, 1.0), |number| (number.trim_end(), 100.0));
    match number.parse::<f64>().map(|x| x / whole) {
        Ok(x) if x > 0.0 && x <= 1.0 => Ok(x),
        _ => Err("a part above 0 and at most 1, such as 0.1 or 10%".to_owned()),
    }
}

/// A number of bytes, in units of 1024 with a suffix: `100000`, `512M`, `2G`.
pub fn size(text: &str) -> Result<u64, String> {
    let shift = match text.bytes().last().map(|b| b.to_ascii_uppercase()) {
        Some(b'K') => 10,
        Some(b'M') => 20,
        Some(b'G') => 30,
        _ => 0,
    };
    let digits = if shift > 0 { &text[..text.len() - 1] } else { text };
    let size = digits.parse::<u64>().ok().and_then(|n| n.checked_mul(1 << shift));
    size.ok_or_else(|| "a number of bytes such as 100000, 512M or 2G".to_owned())
}

/// `none`, `all`, `every:N` or levels separated by commas.
pub fn keyframes(text: &str) -> Result<Keyframes, String> {
    let levels = || text.split(',').map(|level| level.trim().parse()).collect::<Result<Vec<u32>, _>>();
    match (text, text.strip_prefix("every:").map(str::parse)) {
        ("none", _) => Ok(Keyframes::None),
        ("all", _) => Ok(Keyframes::All),
        (_, Some(Ok(n))) if n > 0 => Ok(Keyframes::Every(n)),
        (_, None) if levels().is_ok() => Ok(Keyframes::Levels(levels().unwrap_or_default())),
        _ => Err("none, all, every:N with N of 1 or more, or level numbers separated by commas".to_owned()),
    }
}

/// A finite number of at least 0.
fn weight(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x >= 0.0 && x.is_finite() => Ok(x),
        _ => Err("a number of at least 0".to_owned()),
    }
}

/// `exact`, `none`, `lattice` or a distance.
pub fn weld(text: &str) -> Result<Weld, String> {
    text.parse().map_err(|_| "exact, none, lattice, or a distance of at least 0 such as 0.001".to_owned())
}

/// The value as it is given.
pub fn value_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(["0", "7", "2k", "512M", "3G"].map(size), [0, 7, 2048, 512 << 20, 3 << 30].map(Ok));
        for text in ["", "K", "-1", "1.5G", "1T", "99999999999G", "é"] {
            assert!(size(text).is_err(), "{text}");
        }
    }

    #[test]
    fn parts() {
        assert_eq!(["1", "0.25", "100%", "25 %"].map(part), [1.0, 0.25, 1.0, 0.25].map(Ok));
        for text in ["", "%", "0", "-0.1", "1.1", "101%", "nan", "inf"] {
            assert!(part(text).is_err(), "{text}");
        }
    }

    #[test]
    fn tolerances() {
        assert_eq!(tolerance("0.5"), Ok(Tolerance::Absolute(0.5)));
        assert_eq!(tolerance("0.5%"), Ok(Tolerance::Percent(0.5)));
        assert_eq!(tolerance("2 %"), Ok(Tolerance::Percent(2.0)));
        for text in ["", "%", "-1", "nan", "inf%", "1%%"] {
            assert!(tolerance(text).is_err(), "{text}");
        }
    }

    #[test]
    fn bounds() {
        let bounded = |measure, most| Ok(Bound { measure, most });
        assert_eq!(bound("0.5"), bounded(Measure::Max, Tolerance::Absolute(0.5)));
        assert_eq!(bound("max:2%"), bounded(Measure::Max, Tolerance::Percent(2.0)));
        assert_eq!(bound("rms:2%"), bounded(Measure::Rms, Tolerance::Percent(2.0)));
        for text in ["", "rms", "rms:", "mean:1", "rms:max:1", "RMS:1", ":1", "rms:-1"] {
            assert!(bound(text).is_err(), "{text}");
        }
    }

    #[test]
    fn weldings() {
        let named = [
            ("exact", Weld::Exact),
            ("none", Weld::None),
            ("lattice", Weld::Lattice),
            ("0.001", Weld::Within(0.001)),
        ];
        for (text, welding) in named {
            assert_eq!(weld(text), Ok(welding));
            assert_eq!(welding.to_string(), text);
        }
        for text in ["", "near", "-1", "nan", "inf", "1%"] {
            assert!(weld(text).is_err(), "{text}");
        }
    }

    #[test]
    fn keyframe_choices() {
        assert_eq!(keyframes("none"), Ok(Keyframes::None));
        assert_eq!(keyframes("all"), Ok(Keyframes::All));
        assert_eq!(keyframes("every:3"), Ok(Keyframes::Every(3)));
        assert_eq!(keyframes("4,2"), Ok(Keyframes::Levels(vec![4, 2])));
        for text in ["", "every:0", "every:", "every:x", "1,,2", "-1", "some"] {
            assert!(keyframes(text).is_err(), "{text}");
        }
    }
}
