//! The settings of an encoding.

use crate::codec::grid::Real;
use crate::error::{Error, Result};
use crate::mesh::Lattice;
use crate::mesh::topology::Weld;
use crate::simplify;

/// Settings of an encoding.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Bits a coordinate, [`MIN_BITS`](Lattice::MIN_BITS) to [`MAX_BITS`](Lattice::MAX_BITS), where `lattice` leaves it to them.
    pub position_bits: u32,
    /// Which lattice the coordinates live on.
    pub lattice: LatticeChoice,
    /// How to simplify.
    pub simplify: simplify::Options,
    /// Which levels get a keyframe.
    pub keyframes: Keyframes,
    /// How coarse the coordinates of coarse levels are.
    pub preview: Preview,
    /// How far coarse levels are lifted towards the vertices that they lack (spec §5.4.5): by which part of such a vertex's height the ends
    /// of its edge follow it, in 64ths. 0 for not at all, so that coarse levels have vertices of the input alone; at most
    /// [`MAX_LIFTING`](crate::limits::MAX_LIFTING). Level 0 is the same. Where not given, 18, or 13 where the first level follows the rows of a
    /// regular sampling or corners have values that vary.
    pub lifting: Option<u8>,
    /// Whether boundary vertices stay.
    pub lock_boundary: bool,
    /// Whether coarse levels may lack small components of the mesh, which are born at the first level that is nearer to the input than they
    /// are large (spec §7.4); where boundary vertices stay, only those without a boundary. A component that a level lacks counts in its
    /// errors with its size.
    pub births: bool,
    /// Which vertices are one.
    pub weld: Weld,
    /// Whether coordinates come back bit for bit at level 0, and of which type they are. All of the mesh must be of it.
    pub exact: Option<Real>,
    /// Whether level 0 has the vertices and triangles of the mesh in their order, none of them welded, and each triangle from
    /// its first corner.
    pub keep_order: bool,
    /// Bits of the numbers of attributes, 1 to 24, by their titles ([`Attribute::title`](crate::mesh::Attribute::title)) or the names of their
    /// semantics, e.g. `("uv", 12)`; of the others as many as [`Quantisation::choose`](crate::mesh::attributes::Quantisation::choose) says.
    pub attribute_bits: Vec<(String, u32)>,
    /// Where attributes are born, by names as in `attribute_bits`, e.g. `("uv", AttributeBirth::Base)`; the others as
    /// [`AttributeBirth::Auto`] says.
    pub attribute_births: Vec<(String, AttributeBirth)>,
    /// What attributes weigh in the choice of what coarse levels lack, finite and at least 0, by names as in `attribute_bits`, e.g.
    /// `("normal", 2.0)`; of the others 1. 0: errors of the attribute do not count, but its charts are kept. Texture coordinates of a mesh
    /// without normals weigh three eighths of it.
    pub attribute_weights: Vec<(String, f64)>,
    /// Whether splits and flips are coded under more models each: 3 to 6 % fewer bytes, decoded more slowly. Where not given, those of a mesh
    /// of at most [`FEW`] vertices are, which is decoded in a few milliseconds anyway.
    pub rich_models: Option<bool>,
    /// Bytes after which a refinement atom ends at the latest, with the operation under way; 1 to 60,000. Where little comes before it, it
    /// ends sooner, but at no fewer than 2,048.
    pub atom_bytes: usize,
    /// Most memory to use, in bytes, as estimated beforehand.
    pub max_memory: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            position_bits: Lattice::DEFAULT_BITS,
            lattice: LatticeChoice::Bits,
            simplify: simplify::Options::default(),
            keyframes: Keyframes::None,
            preview: Preview::Auto,
            lifting: None,
            lock_boundary: false,
            births: true,
            weld: Weld::Exact,
            exact: None,
            keep_order: false,
            attribute_bits: Vec::new(),
            attribute_births: Vec::new(),
            attribute_weights: Vec::new(),
            rich_models: None,
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
        Self { simplify: profile.simplify(), rich_models: profile.rich_models(), ..Self::default() }
    }
}

impl Options {
    /// Whether the models of a mesh of so many vertices are rich.
    pub(super) fn has_rich_models(&self, vertices: usize) -> bool {
        self.rich_models.unwrap_or(vertices <= FEW)
    }
}

/// Vertices up to which models are rich where [`Options::rich_models`] does not say.
pub const FEW: usize = 4096;

/// More than a quarter: levels are nearer to the input by 2 to 4 % than at a fifth, and places cost 0.3 % more.
pub(super) const LIFTING: u8 = 18;
/// A fifth: what is lifted off a row is no longer told by it, which costs 2 to 3 % at more than a quarter. Where values vary at corners, more
/// has not been found to pay.
pub(super) const LIFTING_OF_ROWS: u8 = 13;

/// Which lattice the coordinates live on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum LatticeChoice {
    /// One over the mesh, of [`Options::position_bits`].
    #[default]
    Bits,
    /// One over the mesh, of the fewest bits for which its step is at most this: finite, above 0.
    AtMost(f64),
    /// A given one, so that meshes that touch have the same points where they do: tiles of a map, say. The bits follow from the
    /// extent of the mesh.
    ///
    /// Where the step is a power of two and the origin a multiple of it, vertices that are equal in two meshes are bit for
    /// bit equal at level 0 of both, and at every level that they belong to: [`Options::lock_boundary`] keeps a common
    /// boundary at all levels. ([`Preview`] makes coarse levels coarser, each mesh on its own: it should be [`Preview::Auto`] or off.)
    Given {
        /// The distance of neighbouring points: finite, above 0.
        step: f64,
        /// Any of the points; finite. The file has another one, near the mesh, as its origin ([`Lattice::part`]).
        origin: [f64; 3],
    },
}

impl Options {
    /// Whether there can be such a lattice and such a welding.
    pub(super) fn check_lattice(&self) -> Result<()> {
        let refused = |what: String| Err(Error::Parameter(what));
        let (min, max) = (Lattice::MIN_BITS, Lattice::MAX_BITS);
        if !(min..=max).contains(&self.position_bits) {
            return refused(format!("position bits must be {min} to {max}, not {}", self.position_bits));
        }
        if let LatticeChoice::AtMost(step) | LatticeChoice::Given { step, .. } = self.lattice
            && !(step.is_finite() && step > 0.0)
        {
            return refused(format!("the step of the lattice must be above 0 and finite, not {step}"));
        }
        if let LatticeChoice::Given { origin, .. } = self.lattice
            && let Some(x) = origin.iter().find(|x| !x.is_finite())
        {
            return refused(format!("the origin of the lattice must be finite, not {x}"));
        }
        if let Weld::Within(distance) = self.weld
            && !(distance.is_finite() && distance >= 0.0)
        {
            return refused(format!("the distance of welding must be at least 0 and finite, not {distance}"));
        }
        Ok(())
    }

    /// The lattice of a mesh with this bounding box.
    pub(super) fn lattice_over(&self, min: [f64; 3], max: [f64; 3]) -> Result<Lattice> {
        let whole = Lattice::over(min, max, self.position_bits);
        if !whole.step.is_finite() {
            let what = "the mesh is larger than the largest number: its extent is infinite";
            return Err(Error::Parameter(what.to_owned()));
        }
        match self.lattice {
            LatticeChoice::Bits => Ok(whole.rounded(max)),
            LatticeChoice::AtMost(step) => {
                let lattice = Lattice::at_most(step, min, max)?;
                // Rounding goes up, and may go beyond what is asked for.
                let rounded = lattice.rounded(max);
                Ok(if rounded.step <= step { rounded } else { lattice })
            }
            LatticeChoice::Given { step, origin } => Lattice::part(step, origin, min, max),
        }
    }
}

/// What matters most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Profile {
    /// For who shows a mesh while it loads and keeps all of it: small, with good levels.
    #[default]
    Default,
    /// For archives and slow lines: the fewest bytes in all. Fewer levels, each a little further from the original; decoding takes longer.
    Small,
    /// For who keeps to coarse levels: prefixes of equal bytes are nearer to the original, the whole file is larger.
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

    /// Its [`Options::rich_models`].
    pub fn rich_models(self) -> Option<bool> {
        (self == Self::Small).then_some(true)
    }
}

/// At which level an attribute is born: coarser ones do not have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum AttributeBirth {
    /// As coarse as it is worth it: texture coordinates and parts at the coarsest level whose vertices are not mostly locked by the borders
    /// of their charts; what is not finite at the finest.
    #[default]
    Auto,
    /// At the base, whatever that locks.
    Base,
    /// At the finest level.
    Finest,
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
/// triangles, and the whole file is hardly larger. Level 0 always has all its bits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Preview {
    /// [`Preview::Fine`], but off where the lattice is given or the boundary locked: tiles are to have common places.
    #[default]
    Auto,
    /// All levels have all bits.
    Off,
    /// The step of a level's grid is at most its mean error, or twice that where levels are not lifted.
    Fine,
    /// Twice as much.
    Coarse,
    /// How many low bits the coordinates of levels 1, 2, … lack. The numbers do not fall; the last holds for all
    /// further levels, none means 0, and more than [`Options::position_bits`] mean as many.
    Schedule(Vec<u32>),
}
