//! How the star of a vertex is parted when the vertex goes: which of its triangles a coarse corner has its label of.

/// The parts of a star. On its link are places, counter-clockwise: triangle i lies between the places i and i + 1, and round a closed star
/// the last one between the last place and the first.
///
/// Each coarse triangle lies in one part: its corners are at places of that, and at the place that the vertex went onto.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parting {
    triangles: usize,
    is_open: bool,
    onto: usize,
    /// The places where one part ends and another begins, a bit each.
    borders: u64,
}

/// What a coarse corner at a place is labelled as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// The corner at the place of the triangle before it.
    Before(usize),
    /// The corner at the place of the triangle behind it.
    Behind(usize),
    /// One or the other of these: both are in its part.
    Either(usize, usize),
    /// The corner at the vertex of a triangle of its part, which has none at the place.
    Own,
}

impl Parting {
    /// Most triangles of a star.
    pub const MOST: usize = 62;

    /// One part.
    pub fn none(triangles: usize, is_open: bool) -> Self {
        debug_assert!(triangles <= Self::MOST);
        Self { triangles, is_open, onto: 0, borders: 0 }
    }

    /// Parts between some places, bits; `onto` is one of them, or an end of an open star. Such ends are borders anyway.
    pub fn onto(triangles: usize, is_open: bool, onto: usize, borders: u64) -> Self {
        debug_assert!(triangles <= Self::MOST && (is_open || borders >> onto & 1 == 1));
        let ends = if is_open { 1 | 1 << triangles } else { 0 };
        Self { triangles, is_open, onto, borders: borders & !ends }
    }

    /// The place that the vertex goes onto.
    pub fn target(&self) -> usize {
        self.onto
    }

    /// Places where parts meet, bits, without the ends of an open star.
    pub fn borders(&self) -> u64 {
        self.borders
    }

    /// The same star, as seen from another place.
    pub fn seen_from(self, place: usize) -> Self {
        if self.is_open || place == 0 {
            return self;
        }
        Self { onto: self.from(place, self.onto), borders: self.turned(place), ..self }
    }

    /// How many parts there are.
    pub fn count(&self) -> usize {
        let borders = self.borders.count_ones() as usize;
        if self.is_open { borders + 1 } else { borders.max(1) }
    }

    /// The part of a triangle of the star.
    #[inline]
    pub fn part(&self, triangle: usize) -> usize {
        (self.borders & ((2 << triangle) - 1)).count_ones() as usize % self.count()
    }

    /// The part of a coarse triangle with corners at these places.
    pub fn part_of(&self, places: [usize; 3]) -> usize {
        let from_onto = places.iter().map(|&place| self.from(self.onto, place));
        let first = from_onto.filter(|&from| from > 0).min().unwrap_or(0);
        if self.borders == 0 { 0 } else { self.part((self.onto + first) % self.places()) }
    }

    /// The triangles of a part.
    pub fn triangles_of(&self, part: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.triangles).filter(move |&i| self.part(i) == part)
    }

    /// The largest triangle of a part, `larger` saying of two whether the second is larger.
    pub fn largest(&self, part: usize, larger: impl Fn(usize, usize) -> bool) -> usize {
        self.triangles_of(part).reduce(|x, y| if larger(x, y) { y } else { x }).unwrap_or(0)
    }

    /// What a coarse corner at a place is labelled as, in a triangle of a part.
    pub fn taken(&self, part: usize, place: usize) -> Taken {
        let before = if place > 0 { Some(place - 1) } else { (!self.is_open).then(|| self.triangles - 1) };
        let behind = Some(place % self.places()).filter(|&i| i < self.triangles);
        let of_part = |triangle: &usize| self.part(*triangle) == part;
        match (before.filter(of_part), behind.filter(of_part)) {
            (Some(x), Some(y)) => Taken::Either(x, y),
            (Some(x), None) => Taken::Before(x),
            (None, Some(y)) => Taken::Behind(y),
            (None, None) => Taken::Own,
        }
    }

    /// Whether nothing is left of a triangle's part: it had but this one, with a side from the vertex to where it went.
    pub fn is_lost(&self, triangle: usize) -> bool {
        let is_border = |place: usize| {
            self.is_open && (place == 0 || place == self.triangles)
                || self.borders >> (place % self.places()) & 1 == 1
        };
        let ends = [triangle, triangle + 1];
        self.borders != 0
            && ends.iter().all(|&place| is_border(place))
            && ends.iter().any(|&place| place % self.places() == self.onto)
    }

    /// The part of the coarse triangle at a triangle's edge on the link: its own, or where that is lost the one beside it.
    pub fn carried(&self, triangle: usize) -> usize {
        match () {
            _ if !self.is_lost(triangle) => self.part(triangle),
            _ if triangle == self.onto => self.part((triangle + 1) % self.triangles),
            _ => self.part((triangle + self.triangles - 1) % self.triangles),
        }
    }

    /// Whether both corners at a place are in one part.
    pub fn is_inner(&self, place: usize) -> bool {
        (0..self.count()).any(|part| matches!(self.taken(part, place), Taken::Either(..)))
    }

    /// Whether an edge between two places would lead from one part to another.
    pub fn crosses(&self, i: usize, j: usize) -> bool {
        let (i, j) = (self.from(self.onto, i), self.from(self.onto, j));
        let (i, j) = (i.min(j), i.max(j));
        i > 0 && self.turned(self.onto) & ((1 << j) - (2 << i)) != 0
    }

    fn places(&self) -> usize {
        self.triangles + usize::from(self.is_open)
    }

    /// How far a place is from another one, counter-clockwise.
    fn from(&self, origin: usize, place: usize) -> usize {
        (place + self.places() - origin) % self.places()
    }

    /// The borders by how far they are from a place.
    fn turned(&self, origin: usize) -> u64 {
        let places = self.places();
        (self.borders >> origin | self.borders << (places - origin)) & ((1 << places) - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(places: &[usize]) -> u64 {
        places.iter().map(|&place| 1 << place).sum()
    }

    /// A closed star of seven triangles: parts of one, two and four of them meet at the places 1, 2 and 4.
    #[test]
    fn parts_lie_between_borders() {
        let at_one = Parting::onto(7, false, 1, bits(&[1, 2, 4]));
        let parts: Vec<_> = (0..7).map(|i| at_one.part(i)).collect();
        assert_eq!(parts, [0, 1, 2, 2, 0, 0, 0]);
        // The part of one triangle has a side to where the vertex goes; the coarse one at its edge is of the next part.
        assert_eq!((0..7).filter(|&i| at_one.is_lost(i)).collect::<Vec<_>>(), [1]);
        assert_eq!(at_one.carried(1), 2);
        // What is left is a fan from there, parted by the edge to 4.
        assert_eq!(
            [[1, 2, 3], [1, 3, 4], [1, 4, 5], [0, 1, 6], [4, 5, 6]].map(|t| at_one.part_of(t)),
            [2, 2, 0, 0, 0]
        );
        assert!([(2, 5), (3, 6), (0, 3)].iter().all(|&(i, j)| at_one.crosses(i, j)));
        assert!(![(1, 4), (2, 4), (4, 6), (0, 5), (1, 6)].iter().any(|&(i, j)| at_one.crosses(i, j)));
        // Its corner in the part that it was not at is the vertex's.
        assert_eq!(at_one.taken(2, 1), Taken::Own);
        assert_eq!(at_one.taken(0, 1), Taken::Before(0));
        assert_eq!((at_one.taken(2, 4), at_one.taken(0, 4)), (Taken::Before(3), Taken::Behind(4)));
        assert_eq!(at_one.taken(2, 3), Taken::Either(2, 3));
        // Onto the far end of the large parts nothing is lost.
        let at_four = Parting::onto(7, false, 4, bits(&[1, 2, 4]));
        assert!(!(0..7).any(|i| at_four.is_lost(i)));
        assert_eq!(at_four.taken(1, 4), Taken::Own);
        // From another place it is the same.
        let turned = at_one.seen_from(3);
        assert_eq!((turned.target(), turned.borders()), (5, bits(&[5, 6, 1])));
        assert!((0..7).all(|i| turned.is_lost(i) == at_one.is_lost((i + 3) % 7)));
    }

    /// At the boundary: three triangles, two of them a part.
    #[test]
    fn ends_of_an_open_star_are_borders() {
        let first = Parting::onto(3, true, 0, bits(&[0, 1]));
        assert_eq!((first.borders(), first.count()), (bits(&[1]), 2));
        assert_eq!(
            (0..3).map(|i| (first.part(i), first.is_lost(i))).collect::<Vec<_>>(),
            [(0, true), (1, false), (1, false)]
        );
        assert_eq!((first.carried(0), first.part_of([0, 1, 2]), first.taken(1, 0)), (1, 1, Taken::Own));
        let last = Parting::onto(3, true, 3, bits(&[1]));
        assert!(!(0..3).any(|i| last.is_lost(i)));
        assert_eq!((last.part_of([0, 1, 3]), last.part_of([1, 2, 3])), (0, 1));
        assert_eq!((last.taken(0, 3), last.taken(1, 3)), (Taken::Own, Taken::Before(2)));
        assert!(last.crosses(0, 2) && !last.crosses(1, 3) && !last.crosses(0, 3));
        let none = Parting::none(3, true);
        assert_eq!((none.count(), none.part_of([0, 2, 3]), none.taken(0, 1)), (1, 0, Taken::Either(0, 1)));
    }
}
