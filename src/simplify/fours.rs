//! Lists of four vertices each, in half the room where there are few vertices.

use crate::mesh::Vertex;

/// A list of four vertices each, [`Vertex::NONE`] among them.
#[derive(Clone, Debug, PartialEq)]
pub enum Fours {
    /// All numbers are below [`u16::MAX`], which stands for none.
    Short(Vec<[u16; 4]>),
    /// Any numbers.
    Long(Vec<[Vertex; 4]>),
}

impl Default for Fours {
    fn default() -> Self {
        Self::Short(Vec::new())
    }
}

impl From<Vec<[Vertex; 4]>> for Fours {
    fn from(mut long: Vec<[Vertex; 4]>) -> Self {
        if long.as_flattened().iter().any(|v| v.is_some() && v.0 >= u32::from(u16::MAX)) {
            long.shrink_to_fit();
            return Self::Long(long);
        }
        // None's number is all ones, however long it is.
        Self::Short(long.iter().map(|four| four.map(|v| v.0 as u16)).collect())
    }
}

impl Fours {
    /// One after the other.
    pub fn iter(&self) -> impl Iterator<Item = [Vertex; 4]> + '_ {
        let (short, long) = match self {
            Self::Short(short) => (&short[..], &[][..]),
            Self::Long(long) => (&[][..], &long[..]),
        };
        let vertex = |v: u16| if v == u16::MAX { Vertex::NONE } else { Vertex(v.into()) };
        short.iter().map(move |four| four.map(vertex)).chain(long.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_come_back_in_either_room() {
        for (most, is_short) in [(65_534, true), (65_535, false), (1 << 20, false)] {
            let list = vec![[Vertex(0), Vertex(most), Vertex(7), Vertex::NONE], [Vertex(65_534); 4]];
            let fours = Fours::from(list.clone());
            assert_eq!(matches!(fours, Fours::Short(_)), is_short, "{most}");
            assert_eq!(fours.iter().collect::<Vec<_>>(), list);
        }
        assert_eq!(Fours::default().iter().count(), 0);
    }
}
