//! Which corners and faces of a file the triangles of a mesh come from.

use crate::mesh::attributes::NO_VALUE;

/// What faces are that are not triangles, in their order; faces are counted from 1.
pub(super) struct Sizes {
    /// Faces of fewer than three corners, and how many.
    pub short: Vec<(u32, u32)>,
    /// Faces of more, and how many.
    pub polygons: Vec<(u32, u32)>,
    /// Those of them that are no fans, and their triangles, as places among their corners.
    pub ears: Vec<(u32, Vec<[u32; 3]>)>,
}

/// Where triangles come from. Faces and corners are counted from 0 over all of the file.
pub(super) struct Origins {
    triangles: usize,
    sizes: Sizes,
}

impl Origins {
    pub(super) fn new(triangles: usize, sizes: Sizes) -> Self {
        Self { triangles, sizes }
    }

    /// What each triangle's face has, by a list of the faces; faces beyond its end have no value.
    pub(super) fn of_faces(&self, list: &[u32]) -> Vec<u32> {
        let mut values = Vec::with_capacity(self.triangles);
        self.each(|face, _| values.push(list.get(face).copied().unwrap_or(NO_VALUE)));
        values
    }

    /// What each corner of the mesh has, by a list of the corners of the file; corners beyond its end have no value.
    pub(super) fn of_corners(&self, list: &[u32]) -> Vec<u32> {
        let mut values = Vec::with_capacity(3 * self.triangles);
        self.each(|_, corners| {
            values.extend(corners.map(|corner| list.get(corner).copied().unwrap_or(NO_VALUE)));
        });
        values
    }

    /// What each triangle's face has, by runs: the face that a value begins at, in ascending order, and the value. Faces before the
    /// first have 0.
    pub(super) fn of_runs(&self, runs: &[(u32, u32)]) -> Vec<u32> {
        let mut values = Vec::with_capacity(self.triangles);
        let (mut next, mut value) = (0, 0);
        self.each(|face, _| {
            while let Some(&(_, begins)) = runs.get(next).filter(|run| run.0 as usize <= face) {
                (next, value) = (next + 1, begins);
            }
            values.push(value);
        });
        values
    }

    /// Tells the face of each triangle, and its corners.
    fn each(&self, mut tell: impl FnMut(usize, [usize; 3])) {
        let Sizes { short, polygons, ears } = &self.sizes;
        let (mut short, mut polygons) = (short.iter().peekable(), polygons.iter().peekable());
        let mut ears = ears.iter().peekable();
        let (mut triangles, mut corners, mut face) = (0, 0, 0usize);
        while triangles < self.triangles {
            let size = short.next_if(|short| short.0 as usize == face + 1);
            match size.or_else(|| polygons.next_if(|polygon| polygon.0 as usize == face + 1)) {
                None => {
                    tell(face, [corners, corners + 1, corners + 2]);
                    (triangles, corners) = (triangles + 1, corners + 3);
                }
                Some(&(_, size)) => {
                    let cut = ears.next_if(|(eared, _)| *eared as usize == face + 1);
                    match cut {
                        Some((_, cut)) => {
                            cut.iter().for_each(|triangle| tell(face, triangle.map(|k| corners + k as usize)))
                        }
                        None => (1..(size as usize).saturating_sub(1))
                            .for_each(|k| tell(face, [corners, corners + k, corners + k + 1])),
                    }
                    triangles += size.saturating_sub(2) as usize;
                    corners += size as usize;
                }
            }
            face += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_all_sizes() {
        // A triangle, an edge, a fan of four, nothing, two ears, a triangle.
        let sizes = Sizes {
            short: vec![(2, 2), (4, 0)],
            polygons: vec![(3, 4), (5, 4)],
            ears: vec![(5, vec![[0, 1, 3], [1, 2, 3]])],
        };
        let origins = Origins::new(6, sizes);
        let numbers: Vec<u32> = (0..15).collect();
        assert_eq!(
            origins.of_corners(&numbers),
            [0, 1, 2, 5, 6, 7, 5, 7, 8, 9, 10, 12, 10, 11, 12, 13, 14, NO_VALUE]
        );
        assert_eq!(origins.of_faces(&[9, 8, 7, 6, 5]), [9, 7, 7, 5, 5, NO_VALUE]);
        assert_eq!(origins.of_runs(&[(1, 4), (3, 5), (4, 6), (5, 4)]), [0, 4, 4, 6, 6, 4]);
    }
}
