//! Faces of any number of corners become triangles.

/// Collects triangles from faces given corner by corner: `corner` for each, then `end`.
#[derive(Default)]
pub(super) struct Fans {
    /// What the faces became.
    pub triangles: Vec<[u32; 3]>,
    /// Faces of more than three corners.
    pub polygons: usize,
    /// Faces of fewer than three corners, which became nothing.
    pub short: usize,
    first: u32,
    last: u32,
    corners: u64,
}

impl Fans {
    /// The next corner of the present face.
    #[inline]
    pub(super) fn corner(&mut self, v: u32) {
        match self.corners {
            0 => self.first = v,
            1 => {}
            _ => self.triangles.push([self.first, self.last, v]),
        }
        self.last = v;
        self.corners += 1;
    }

    /// The present face has no more corners.
    #[inline]
    pub(super) fn end(&mut self) {
        match self.corners {
            0..3 => self.short += 1,
            3 => {}
            _ => self.polygons += 1,
        }
        self.corners = 0;
    }

    /// The note about faces that became nothing, if there were any.
    pub(super) fn note_short(&self) -> Option<String> {
        (self.short > 0).then(|| format!("faces with fewer than 3 corners ({})", self.short))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_is_a_fan_from_its_first_corner() {
        let mut fans = Fans::default();
        for face in [&[5, 6, 7, 8, 9][..], &[1, 2], &[], &[1, 1, 2]] {
            face.iter().for_each(|&v| fans.corner(v));
            fans.end();
        }
        assert_eq!(fans.triangles, [[5, 6, 7], [5, 7, 8], [5, 8, 9], [1, 1, 2]]);
        assert_eq!((fans.polygons, fans.short), (1, 2));
    }
}
