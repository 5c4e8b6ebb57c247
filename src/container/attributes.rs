//! What the table of contents says of each attribute (spec §3.3).

use super::constant;
use super::fields::{Fields, is_short};
use super::magnitude;
#[cfg(any(test, feature = "encode"))]
use crate::entropy::varint;
use crate::error::FormatError;
#[cfg(any(test, feature = "encode"))]
use crate::error::{Error, Result};
#[cfg(any(test, feature = "encode"))]
use crate::mesh::attributes::{Attribute, NO_VALUE};
use crate::mesh::attributes::{Domain, Kind, Quantisation, Semantic, Stored};

/// An attribute but for its values.
#[derive(Clone, Debug, PartialEq)]
pub struct AttributeEntry {
    /// What the values are.
    pub semantic: Semantic,
    /// Which of several of the same semantic, from 0.
    pub set: u32,
    /// What the source calls it where the semantic does not say all; else empty. At most [`AttributeEntry::MAX_NAME_BYTES`].
    pub name: String,
    /// What has a value.
    pub domain: Domain,
    /// Numbers a value, 1 to [`Attribute::MAX_COMPONENTS`](crate::mesh::attributes::Attribute::MAX_COMPONENTS).
    pub components: usize,
    /// How the source stores a number.
    pub stored: Stored,
    /// Whether integers stand for fractions; never of floating-point numbers.
    pub normalised: bool,
    /// Whether some corners, or triangles, may have no value.
    pub partial: bool,
    /// The coarsest level that has it, 0 to the base. That of a constant attribute is the base, whatever is said here.
    pub birth: u32,
    /// How numbers are coded.
    pub quantisation: Quantisation,
    /// Root mean square of what quantisation loses, in the units of the values, of [`Quantisation::Octahedral`] in degrees; finite.
    /// 0 where nothing is lost by kind. A file has it rounded up, as the errors of levels.
    pub error: f64,
    /// The integers of the value that all corners, or triangles, have, where there is but that one: then there is no payload of it. On a
    /// [`Quantisation::Lattice`] they are 0 and the origin is the value, which is a multiple of a power of two; its bits do not matter.
    pub constant: Option<Vec<i32>>,
}

impl AttributeEntry {
    /// Most bytes of a name.
    pub const MAX_NAME_BYTES: usize = 255;

    /// That of an attribute that is coded so, with this `error`.
    #[cfg(any(test, feature = "encode"))]
    pub fn of(attribute: &Attribute, quantisation: Quantisation, error: f64) -> Self {
        Self {
            semantic: attribute.semantic,
            set: attribute.set,
            name: attribute.name.clone(),
            domain: attribute.domain,
            components: attribute.components,
            stored: attribute.values.stored(),
            normalised: attribute.normalised,
            partial: attribute.corners.contains(&NO_VALUE),
            birth: 0,
            quantisation,
            error,
            constant: None,
        }
    }

    /// What it is called: its name, or its semantic and set, e.g. `"uv"` and `"uv1"`.
    pub fn title(&self) -> String {
        self.semantic.title(&self.name, self.set)
    }

    /// What a coder is to know of it.
    pub fn kind(&self) -> Kind {
        let Self { semantic, domain, components, stored, partial, .. } = *self;
        let (quantisation, constant) = (self.quantisation.clone(), self.constant.clone());
        Kind { semantic, domain, components, stored, partial, quantisation, constant }
    }

    /// Bits a coded number; `None` where they are those that are stored, and where none is coded.
    pub fn bits(&self) -> Option<u32> {
        match self.quantisation {
            _ if self.constant.is_some() => None,
            Quantisation::Lattice { bits, .. } | Quantisation::Octahedral { bits } => Some(bits),
            Quantisation::Integer | Quantisation::Raw => None,
        }
    }

    /// Whether levels tell how far they are from the input in it, from its birth on: not of what is constant, nor of joints and their weights,
    /// of which a difference says nothing.
    pub fn has_level_errors(&self) -> bool {
        self.constant.is_none() && !matches!(self.semantic, Semantic::Joints | Semantic::Weights)
    }

    /// Whether differences of its values are angles.
    pub fn is_of_directions(&self) -> bool {
        matches!(self.semantic, Semantic::Normal | Semantic::Tangent) && self.components >= 3
    }

    /// What its levels' errors are counted in, and how many there are of each level.
    pub(super) fn level_errors(&self) -> (f64, usize) {
        let unit = match self.quantisation {
            Quantisation::Lattice { step, .. } if !self.is_of_directions() => magnitude::unit(step),
            _ => 1.0,
        };
        (unit, if self.semantic == Semantic::Part { 1 } else { 2 })
    }

    /// Reads the next one. Whether there is the level that it is born at is not known yet.
    pub(super) fn read(fields: &mut Fields) -> std::result::Result<Self, FormatError> {
        let at = fields.offset();
        let [types, shape, marks] = [fields.u8()?, fields.u8()?, fields.u8()?];
        let semantic = Semantic::ALL.get(usize::from(types & 15)).copied();
        let semantic =
            semantic.ok_or_else(|| fields.fault(at, format!("unknown semantic {}", types & 15)))?;
        let stored = Stored::ALL.get(usize::from(types >> 4)).copied();
        let stored = stored.ok_or_else(|| fields.fault(at, format!("unknown stored type {}", types >> 4)))?;
        let (components, kind) = (usize::from(shape & 15) + 1, shape >> 4);
        fields.require(kind <= RAW, at + 1, || format!("unknown quantisation {kind}"))?;
        fields.require(marks <= ALL_MARKS, at + 2, || format!("unknown marks {marks} of an attribute"))?;
        let domain = if marks & TRIANGLES > 0 { Domain::Triangle } else { Domain::Corner };
        let [normalised, partial, is_constant] = [NORMALISED, PARTIAL, CONSTANT].map(|mark| marks & mark > 0);
        fields.require(!(normalised && stored.is_float()), at + 2, || {
            "floating-point numbers that stand for fractions".to_owned()
        })?;
        let has_lattice = kind == LATTICE && !is_constant;
        fields.require(has_lattice || marks & (ORIGIN_SHORT | STEP_SHORT) == 0, at + 2, || {
            "marks of a lattice where there is none".to_owned()
        })?;
        fields.require(!(is_constant && partial), at + 2, || {
            "a value that all have, where some have none".to_owned()
        })?;
        fields.require(stored.is_float() != (kind == INTEGER), at + 1, || {
            format!("quantisation {kind} of {} numbers", stored.name())
        })?;
        let is_unit = matches!((semantic, components), (Semantic::Normal, 3) | (Semantic::Tangent, 4));
        fields.require(kind != OCTAHEDRAL || is_unit, at + 1, || {
            format!("octahedral coordinates of {components} numbers of {}", semantic.name())
        })?;
        let is_part = components == 1 && domain == Domain::Triangle && !stored.is_float();
        fields.require(semantic != Semantic::Part || is_part, at, || {
            "a part is one integer a triangle".to_owned()
        })?;
        let set = fields.count(u32::MAX, "the set of an attribute")?;
        let birth =
            if is_constant { 0 } else { fields.count(u32::MAX, "the level of an attribute's birth")? };
        let length = fields.count(Self::MAX_NAME_BYTES as u32, "the length of an attribute's name")?;
        let at = fields.offset();
        let name = fields.bytes(length as usize)?.to_vec();
        let name = String::from_utf8(name).map_err(|_| fields.fault(at, "a name is not UTF-8".to_owned()))?;
        let quantisation = match kind {
            INTEGER => Quantisation::Integer,
            LATTICE if is_constant => constant::lattice(fields, components)?,
            LATTICE => lattice(fields, marks, components)?,
            OCTAHEDRAL => Quantisation::Octahedral { bits: bits(fields, OCTAHEDRAL_BITS)? },
            _ => Quantisation::Raw,
        };
        let constant = match is_constant {
            true => Some(constant::integers(fields, &quantisation, components, stored)?),
            false => None,
        };
        let error = match unit(&quantisation) {
            Some(unit) => {
                let at = fields.offset();
                let code = fields.u16()?;
                let error = magnitude::value(code, unit);
                let is_finite = code <= magnitude::MAX_CODE && error.is_finite();
                fields.require(is_finite, at, || "the error of an attribute is not finite".to_owned())?;
                error
            }
            None => 0.0,
        };
        Ok(Self {
            semantic,
            set,
            name,
            domain,
            components,
            stored,
            normalised,
            partial,
            birth,
            quantisation,
            error,
            constant,
        })
    }

    /// What it takes in a table of contents; `None` where it has no form there.
    #[cfg(feature = "encode")]
    pub(crate) fn table_bytes(&self) -> Option<usize> {
        let mut bytes = Vec::new();
        self.write(&mut bytes).ok().map(|()| bytes.len())
    }

    /// Appends it to a table of contents. Who reads it finds what breaks a rule; what has no form at all is refused here.
    #[cfg(any(test, feature = "encode"))]
    pub(super) fn write(&self, table: &mut Vec<u8>) -> Result<()> {
        let refused = |what: &str| Err(Error::Parameter(format!("{}: {what}", self.title())));
        if !(1..=Attribute::MAX_COMPONENTS).contains(&self.components) {
            return refused("no such number of numbers a value");
        }
        let place = |all: &[Stored]| all.iter().position(|stored| *stored == self.stored);
        let semantic = Semantic::ALL.iter().position(|semantic| *semantic == self.semantic);
        let (Some(semantic), Some(stored)) = (semantic, place(&Stored::ALL)) else {
            return refused("no number of its semantic or type");
        };
        let is_constant = self.constant.is_some();
        let (kind, forms) = match &self.quantisation {
            Quantisation::Lattice { .. } if is_constant => (LATTICE, 0),
            Quantisation::Integer => (INTEGER, 0),
            Quantisation::Lattice { origin, step, .. } => (LATTICE, forms(origin, *step)),
            Quantisation::Octahedral { .. } => (OCTAHEDRAL, 0),
            Quantisation::Raw => (RAW, 0),
        };
        let marks = [
            (self.domain == Domain::Triangle, TRIANGLES),
            (self.normalised, NORMALISED),
            (self.partial, PARTIAL),
            (is_constant, CONSTANT),
        ];
        let marks = marks.into_iter().filter(|(set, _)| *set).fold(forms, |marks, (_, mark)| marks | mark);
        table.extend([semantic as u8 | (stored as u8) << 4, (self.components - 1) as u8 | kind << 4, marks]);
        varint::write(self.set.into(), table);
        if !is_constant {
            varint::write(self.birth.into(), table);
        }
        varint::write(self.name.len() as u64, table);
        table.extend(self.name.as_bytes());
        if let Quantisation::Lattice { bits, .. } | Quantisation::Octahedral { bits } = self.quantisation
            && !(is_constant && kind == LATTICE)
        {
            let Ok(bits) = u8::try_from(bits) else { return refused("no such number of bits") };
            table.push(bits);
        }
        if let Quantisation::Lattice { origin, .. } = &self.quantisation
            && origin.len() != self.components
        {
            return refused("the origin has another number of numbers");
        }
        if let Some(value) = &self.constant {
            if constant::write(value, &self.quantisation, self.components, self.stored, table).is_none() {
                return refused("no such constant");
            }
        } else if let Quantisation::Lattice { origin, step, .. } = &self.quantisation {
            let numbers = origin.iter().map(|&x| (x, ORIGIN_SHORT)).chain([(*step, STEP_SHORT)]);
            for (x, short) in numbers {
                match forms & short {
                    0 => table.extend(x.to_le_bytes()),
                    _ => table.extend((x as f32).to_le_bytes()),
                }
            }
        }
        match unit(&self.quantisation) {
            Some(unit) => match magnitude::code(self.error, unit) {
                Some(code) => table.extend(code.to_le_bytes()),
                None => return refused("an error that is negative, not finite or too large"),
            },
            None if self.error == 0.0 => {}
            None => return refused("an error where nothing is lost"),
        }
        Ok(())
    }
}

fn lattice(
    fields: &mut Fields,
    marks: u8,
    components: usize,
) -> std::result::Result<Quantisation, FormatError> {
    let bits = bits(fields, LATTICE_BITS)?;
    let at = fields.offset();
    let origin = (0..components)
        .map(|_| fields.real(marks & ORIGIN_SHORT > 0, "an attribute's origin"))
        .collect::<std::result::Result<Vec<_>, _>>()?;
    let step_at = fields.offset();
    let step = fields.real(marks & STEP_SHORT > 0, "an attribute's step")?;
    fields.require(step >= 0.0, step_at, || "an attribute's step is negative".to_owned())?;
    fields.require(forms(&origin, step) == marks & (ORIGIN_SHORT | STEP_SHORT), at, || {
        "an attribute's lattice is not in its shortest form".to_owned()
    })?;
    Ok(Quantisation::Lattice { bits, origin, step })
}

fn bits(fields: &mut Fields, [least, most]: [u8; 2]) -> std::result::Result<u32, FormatError> {
    let at = fields.offset();
    let bits = fields.u8()?;
    fields.require((least..=most).contains(&bits), at, || {
        format!("an attribute of {bits} bits a number, allowed {least} to {most}")
    })?;
    Ok(bits.into())
}

/// Which numbers of a lattice are binary32 because that is enough, as marks.
fn forms(origin: &[f64], step: f64) -> u8 {
    let is_short = |x: &f64| is_short(*x);
    u8::from(origin.iter().all(is_short)) * ORIGIN_SHORT + u8::from(is_short(&step)) * STEP_SHORT
}

/// What the error is counted in; `None` where nothing can be lost.
fn unit(quantisation: &Quantisation) -> Option<f64> {
    match quantisation {
        Quantisation::Lattice { step, .. } => Some(magnitude::unit(*step)),
        Quantisation::Octahedral { .. } => Some(1.0),
        Quantisation::Integer | Quantisation::Raw => None,
    }
}

/// Kinds of quantisation.
const INTEGER: u8 = 0;
const LATTICE: u8 = 1;
const OCTAHEDRAL: u8 = 2;
const RAW: u8 = 3;

/// Marks of an attribute.
const TRIANGLES: u8 = 1;
const NORMALISED: u8 = 2;
const PARTIAL: u8 = 4;
const ORIGIN_SHORT: u8 = 8;
const STEP_SHORT: u8 = 16;
const CONSTANT: u8 = 32;
const ALL_MARKS: u8 = 63;

/// Fewest and most bits a number.
const LATTICE_BITS: [u8; 2] = [1, 24];
const OCTAHEDRAL_BITS: [u8; 2] = [2, 16];

#[cfg(test)]
mod tests;
