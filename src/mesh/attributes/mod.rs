//! What a mesh has beside positions: values at its corners and triangles, such as texture coordinates, normals, colours and parts.

pub(crate) mod dyadic;
pub(crate) mod quantise;
mod values;
#[cfg(feature = "encode")]
pub(crate) mod worth;

use super::index::Corner;

pub use quantise::Quantisation;
pub use values::{Stored, Values};

/// Stands for "no value here" in [`Attribute::corners`].
pub const NO_VALUE: u32 = u32::MAX;

/// What the values of an attribute are: how they are predicted, priced and drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Semantic {
    /// Unit normals, 3 components.
    Normal,
    /// Unit tangents and the side of the bitangent, 4 components.
    Tangent,
    /// Texture coordinates, 2 or 3 components.
    TexCoord,
    /// Colours, 3 or 4 components.
    Color,
    /// Numbers of joints.
    Joints,
    /// Weights of joints.
    Weights,
    /// Which part a triangle belongs to: mesh, group and material together. One component, [`Domain::Triangle`].
    Part,
    /// Anything else.
    Generic,
}

impl Semantic {
    /// All of them, in the order of their numbers in a file (spec §3.3).
    pub const ALL: [Self; 8] = [
        Self::Normal,
        Self::Tangent,
        Self::TexCoord,
        Self::Color,
        Self::Joints,
        Self::Weights,
        Self::Part,
        Self::Generic,
    ];

    /// The name that the command line and messages use, e.g. `"uv"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Tangent => "tangent",
            Self::TexCoord => "uv",
            Self::Color => "color",
            Self::Joints => "joints",
            Self::Weights => "weights",
            Self::Part => "part",
            Self::Generic => "generic",
        }
    }

    /// What an attribute of this semantic is called: its name, or the semantic and its set, e.g. `"uv"` and `"uv1"`.
    pub fn title(self, name: &str, set: u32) -> String {
        match (name, set) {
            ("", 0) => self.name().to_owned(),
            ("", set) => format!("{}{set}", self.name()),
            (name, _) => name.to_owned(),
        }
    }
}

/// What has a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Domain {
    /// Each corner.
    Corner,
    /// Each triangle.
    Triangle,
}

impl Domain {
    /// What it is called in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Corner => "corner",
            Self::Triangle => "triangle",
        }
    }
}

/// A value for each corner, or for each triangle.
///
/// Corners of a vertex with the same values in all attributes are one *wedge* (spec §13.3): what a graphics processor calls a vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// What the values are.
    pub semantic: Semantic,
    /// Which of several of the same semantic, from 0: `TEXCOORD_1` is set 1.
    pub set: u32,
    /// What the source calls it where the semantic does not say all, e.g. `"quality"`; else empty.
    pub name: String,
    /// What has a value.
    pub domain: Domain,
    /// Numbers a value, 1 to [`Attribute::MAX_COMPONENTS`].
    pub components: usize,
    /// Whether integers stand for fractions: of 0 to 1, or of -1 to 1 where they have a sign.
    pub normalised: bool,
    /// The values, `components` numbers each.
    pub values: Values,
    /// The value of each corner, three a triangle, or of each triangle: a number below `count()`, or [`NO_VALUE`].
    pub corners: Vec<u32>,
}

impl Attribute {
    /// Most numbers that a value has.
    pub const MAX_COMPONENTS: usize = 16;

    /// An attribute without a name, first of its set, at corners.
    pub fn new(semantic: Semantic, components: usize, values: Values, corners: Vec<u32>) -> Self {
        let (set, name, domain, normalised) = (0, String::new(), Domain::Corner, false);
        Self { semantic, set, name, domain, components, normalised, values, corners }
    }

    /// Parts of triangles by number.
    pub fn parts(of_triangles: &[u32]) -> Self {
        let mut parts: Vec<u32> = of_triangles.to_vec();
        parts.sort_unstable();
        parts.dedup();
        let place = |part: &u32| parts.binary_search(part).map_or(NO_VALUE, |place| place as u32);
        let corners = of_triangles.iter().map(place).collect();
        Self { domain: Domain::Triangle, ..Self::new(Semantic::Part, 1, Values::U32(parts), corners) }
    }

    /// How many values there are.
    pub fn count(&self) -> usize {
        self.values.len() / self.components.max(1)
    }

    /// The value of a corner, by its triangle's number and its place there; `None` where it has none.
    pub fn at(&self, triangle: usize, place: usize) -> Option<usize> {
        let at = match self.domain {
            Domain::Corner => 3 * triangle + place,
            Domain::Triangle => triangle,
        };
        self.corners.get(at).copied().filter(|&value| value != NO_VALUE).map(|value| value as usize)
    }

    /// As [`Attribute::at`], for a corner of a table that has the triangles in the same order.
    pub fn of(&self, c: Corner) -> Option<usize> {
        self.at(c.triangle().index(), c.place())
    }

    /// What it is called: its name, or its semantic and set, e.g. `"uv"` and `"uv1"`.
    pub fn title(&self) -> String {
        self.semantic.title(&self.name, self.set)
    }

    /// Whether it is an attribute of so many triangles.
    ///
    /// # Errors
    /// What is wrong with it, in words for the user.
    pub fn check(&self, triangles: usize) -> Result<(), String> {
        let wanted = if self.domain == Domain::Corner { 3 * triangles } else { triangles };
        let title = self.title();
        if !(1..=Self::MAX_COMPONENTS).contains(&self.components) {
            return Err(format!(
                "{title}: {} numbers a value, allowed 1 to {}",
                self.components,
                Self::MAX_COMPONENTS
            ));
        }
        if !self.values.len().is_multiple_of(self.components) {
            return Err(format!(
                "{title}: {} numbers are no values of {} each",
                self.values.len(),
                self.components
            ));
        }
        if self.corners.len() != wanted {
            return Err(format!(
                "{title}: {} indices of values where there are {wanted}",
                self.corners.len()
            ));
        }
        let count = self.count();
        match self.corners.iter().position(|&value| value != NO_VALUE && value as usize >= count) {
            Some(at) => Err(format!("{title}: index {at} names value {} of {count}", self.corners[at])),
            None => Ok(()),
        }
    }
}

/// What a coder is to know of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    /// What the values are.
    pub semantic: Semantic,
    /// What has a value.
    pub domain: Domain,
    /// Numbers of the source a value.
    pub components: usize,
    /// How the source stores them.
    pub stored: Stored,
    /// Whether there are corners, or triangles, without a value.
    pub partial: bool,
    /// How numbers became integers.
    pub quantisation: Quantisation,
    /// The integers of the value that all corners, or triangles, have, where there is but that one: nothing of it is coded.
    pub constant: Option<Vec<i32>>,
}

impl Kind {
    /// Integers a value.
    pub fn integers(&self) -> usize {
        self.quantisation.integers(self.components, self.stored)
    }

    /// Whether it has values of `domain` that are to be coded.
    pub fn is_coded_at(&self, domain: Domain) -> bool {
        self.domain == domain && self.constant.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_told() {
        let uv =
            |corners| Attribute::new(Semantic::TexCoord, 2, Values::F32(vec![0.0, 0.5, 1.0, 0.5]), corners);
        assert_eq!(uv(vec![0, 1, NO_VALUE]).check(1), Ok(()));
        assert_eq!(uv(vec![0, 1]).check(1), Err("uv: 2 indices of values where there are 3".into()));
        assert_eq!(uv(vec![0, 1, 2]).check(1), Err("uv: index 2 names value 2 of 2".into()));
        let odd = Attribute { components: 3, ..uv(vec![0; 3]) };
        assert_eq!(odd.check(1), Err("uv: 4 numbers are no values of 3 each".into()));
        let wide = Attribute { components: 17, ..uv(vec![0; 3]) };
        assert_eq!(wide.check(1), Err("uv: 17 numbers a value, allowed 1 to 16".into()));
    }

    #[test]
    fn parts_are_named_once() {
        let parts = Attribute::parts(&[7, 2, 7]);
        assert_eq!((&parts.values, &parts.corners), (&Values::U32(vec![2, 7]), &vec![1, 0, 1]));
        assert_eq!([0, 1, 2].map(|t| parts.at(t, 2)), [Some(1), Some(0), Some(1)]);
        assert_eq!(parts.check(3), Ok(()));
    }
}
