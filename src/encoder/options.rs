//! The settings of an encoding.

use crate::codec::grid::Real;
use crate::mesh::topology::Weld;
use crate::simplify;

/// Settings of an encoding.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Bits a coordinate, [`MIN_BITS`](crate::mesh::Lattice::MIN_BITS) to [`MAX_BITS`](crate::mesh::Lattice::MAX_BITS).
    pub position_bits: u32,
    /// How to simplify.
    pub simplify: simplify::Options,
    /// Which levels get a keyframe.
    pub keyframes: Keyframes,
    /// How coarse the coordinates of coarse levels are.
    pub preview: Preview,
    /// Whether boundary vertices stay.
    pub lock_boundary: bool,
    /// Which vertices are one.
    pub weld: Weld,
    /// Whether coordinates come back bit for bit at level 0, and of which type they are. All of the mesh must be of it.
    pub exact: Option<Real>,
    /// Whether level 0 has the vertices and triangles of the mesh in their order, none of them welded, and each triangle from
    /// its first corner.
    pub keep_order: bool,
    /// Bytes after which a refinement atom ends, with the operation under way; 1 to 60,000.
    pub atom_bytes: usize,
    /// Most memory to use, in bytes, as estimated beforehand.
    pub max_memory: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            position_bits: 14,
            simplify: simplify::Options::default(),
            keyframes: Keyframes::None,
            preview: Preview::Off,
            lock_boundary: false,
            weld: Weld::Exact,
            exact: None,
            keep_order: false,
            atom_bytes: 16 << 10,
            max_memory: u64::MAX,
        }
    }
}

impl Options {
    /// The default settings but for those that a profile makes different.
    ///
    /// ```
    /// use unweld::encoder::{Encoder, Options, Profile};
    /// let options = Options { position_bits: 12, ..Options::profile(Profile::Small) };
    /// let file = Encoder::new(options).encode_to_vec(&unweld::mesh::shapes::sphere(4))?;
    /// # Ok::<(), unweld::Error>(())
    /// ```
    pub fn profile(profile: Profile) -> Self {
        Self { simplify: profile.simplify(), ..Self::default() }
    }
}

/// What matters most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// A balance.
    #[default]
    Default,
    /// Few bytes in all: fewer levels, each further from the original.
    Small,
    /// Levels near the original, for more bytes.
    Fine,
}

impl Profile {
    /// How it simplifies.
    pub fn simplify(self) -> simplify::Options {
        match self {
            Self::Default => simplify::Options::default(),
            Self::Small => simplify::Options::small(),
            Self::Fine => simplify::Options::fine(),
        }
    }
}

/// Which levels get a keyframe; the base always has one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Keyframes {
    /// None but the base.
    #[default]
    None,
    /// Every level.
    All,
    /// The levels whose number is a multiple of this.
    Every(u32),
    /// These levels.
    Levels(Vec<u32>),
}

impl Keyframes {
    pub(super) fn contains(&self, level: u32) -> bool {
        match self {
            Self::None => false,
            Self::All => true,
            Self::Every(n) => level.is_multiple_of((*n).max(1)),
            Self::Levels(levels) => levels.contains(&level),
        }
    }
}

/// How coarse the coordinates of coarse levels are (spec §5.6). With fewer bits at first, the first kilobytes show more
/// triangles, and the whole file is larger by some percent. Level 0 always has all its bits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Preview {
    /// All levels have all bits.
    #[default]
    Off,
    /// The step of a level's grid is at most an eighth of its mean edge.
    Coarse,
    /// How many low bits the coordinates of levels 1, 2, … lack. The numbers do not fall; the last holds for all
    /// further levels, none means 0, and more than [`Options::position_bits`] mean as many.
    Schedule(Vec<u32>),
}
