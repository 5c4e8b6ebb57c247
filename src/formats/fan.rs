//! Faces of any number of corners become triangles: fans from the first corner, or ears where a fan does not do.

use crate::mesh::IndexedMesh;

use super::ears::{Cut, Cutter};
use super::origins::{Origins, Sizes};

/// Collects triangles from faces given corner by corner: `corner` for each, then `end`; at the end of the file
/// [`Fans::mesh`], which alone can look at positions, since these may come last.
#[derive(Default)]
pub(super) struct Fans {
    /// What the faces became, polygons as fans.
    pub triangles: Vec<[u32; 3]>,
    /// Faces of more than three corners.
    polygons: Vec<Polygon>,
    /// Faces of fewer than three corners, which became nothing: which, from 1, and their corners.
    short: Vec<(u32, u32)>,
    /// Faces that ended.
    faces: u32,
    /// Their corners.
    ended: usize,
    first: u32,
    last: u32,
    corners: u32,
}

/// Where a face of more than three corners is. Numbers beyond 32 bits are beyond the limit of a mesh, too.
struct Polygon {
    /// The first triangle of its fan.
    triangle: u32,
    corners: u32,
    /// From 1.
    face: u32,
}

/// What the faces of a file became.
pub(super) struct Faces {
    pub mesh: IndexedMesh,
    /// Faces of more than three corners.
    pub polygons: usize,
    /// What there is to say of them to the user.
    pub notes: Vec<String>,
    /// Which of the file's faces and corners the triangles have.
    pub origins: Origins,
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
        self.corners = self.corners.saturating_add(1);
    }

    /// The present face has no more corners.
    #[inline]
    pub(super) fn end(&mut self) {
        self.faces = self.faces.saturating_add(1);
        self.ended += self.corners as usize;
        match self.corners {
            0..3 => self.short.push((self.faces, self.corners)),
            3 => {}
            corners => {
                let triangle = self.triangles.len().saturating_sub(corners as usize - 2) as u32;
                self.polygons.push(Polygon { triangle, corners, face: self.faces });
            }
        }
        self.corners = 0;
    }

    /// Faces so far.
    pub(super) fn faces(&self) -> u32 {
        self.faces
    }

    /// Corners of all faces so far, those of the present one included.
    #[inline]
    pub(super) fn corners(&self) -> usize {
        self.ended + self.corners as usize
    }

    /// The mesh. A polygon stays the fan that it is where no triangle of that turns against the polygon's normal; all others
    /// are cut into ears. `positions` are as many as the corners named.
    pub(super) fn mesh(mut self, positions: Vec<[f64; 3]>) -> Faces {
        let mut cutter = Cutter::default();
        let (mut corners, mut places) = (Vec::new(), Vec::new());
        let (mut crossed, mut first_crossed) = (0usize, 0);
        let mut sizes = Sizes { short: self.short, polygons: Vec::new(), ears: Vec::new() };
        for polygon in &self.polygons {
            sizes.polygons.push((polygon.face, polygon.corners));
            let fan = polygon.triangle as usize..polygon.triangle as usize + polygon.corners as usize - 2;
            let Some(fan) = self.triangles.get_mut(fan) else { continue };
            corners.clear();
            corners.extend_from_slice(&fan[0][..2]);
            corners.extend(fan.iter().map(|triangle| triangle[2]));
            places.clear();
            places.extend(corners.iter().map(|&v| positions[v as usize]));
            let cut = cutter.cut(&places);
            if let Cut::Ears(ears) = cut.triangles {
                for (triangle, ear) in fan.iter_mut().zip(&ears) {
                    *triangle = ear.map(|k| corners[k as usize]);
                }
                sizes.ears.push((polygon.face, ears));
            }
            if cut.crossed {
                first_crossed = if crossed == 0 { polygon.face } else { first_crossed };
                crossed += 1;
            }
        }
        let mut notes = Vec::new();
        if !sizes.short.is_empty() {
            notes.push(format!("faces with fewer than 3 corners ({})", sizes.short.len()));
        }
        if crossed > 0 {
            notes.push(format!(
                "which side is inside in polygons that cross themselves ({crossed}, the first is face {first_crossed}, counted from 1)"
            ));
        }
        let mesh = IndexedMesh::new(positions, self.triangles);
        let origins = Origins::new(mesh.triangles.len(), sizes);
        Faces { mesh, polygons: self.polygons.len(), notes, origins }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faces(corners: &[&[u32]], positions: Vec<[f64; 3]>) -> Faces {
        let mut fans = Fans::default();
        for face in corners {
            face.iter().for_each(|&v| fans.corner(v));
            fans.end();
        }
        fans.mesh(positions)
    }

    #[test]
    fn a_polygon_is_a_fan_from_its_first_corner() {
        // Of a circle, so that any of its polygons is convex.
        let circle = (0..10).map(|k| (f64::from(k) / 2.0).sin_cos()).map(|(y, x)| [x, y, 3.0]).collect();
        let faces = faces(&[&[5, 6, 7, 8, 9], &[1, 2], &[], &[1, 1, 2]], circle);
        assert_eq!(faces.mesh.triangles, [[5, 6, 7], [5, 7, 8], [5, 8, 9], [1, 1, 2]]);
        assert_eq!(
            (faces.polygons, &faces.notes[..]),
            (1, &["faces with fewer than 3 corners (2)".to_owned()][..])
        );
    }

    #[test]
    fn an_arrow_head_is_cut_through_its_reflex_corner() {
        let head = vec![[9.0; 3], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [4.0, 0.0, 0.0], [1.0, 3.0, 0.0]];
        // Corner 2 is the reflex one, so 2-4 is the only diagonal; a fan from 1 would be cut along 1-3.
        for (face, diagonal) in [([1, 2, 3, 4], [2, 4]), ([4, 3, 2, 1], [2, 4]), ([3, 4, 1, 2], [2, 4])] {
            let cut = faces(&[&[1, 2, 3], &face, &[3, 2, 1]], head.clone());
            assert_eq!((cut.mesh.triangles[0], cut.mesh.triangles[3]), ([1, 2, 3], [3, 2, 1]));
            for triangle in &cut.mesh.triangles[1..3] {
                assert!(diagonal.iter().all(|v| triangle.contains(v)), "{face:?} {triangle:?}");
            }
            assert_eq!(cut.notes, [""; 0]);
        }
        // From its reflex corner a fan is right.
        assert_eq!(faces(&[&[2, 3, 4, 1]], head).mesh.triangles, [[2, 3, 4], [2, 4, 1]]);
    }

    #[test]
    fn what_crosses_itself_is_told() {
        let bow = vec![[0.0, 0.0, 0.0], [2.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let cut = faces(&[&[0, 2, 1], &[0, 1, 2, 3], &[0, 2, 1, 3]], bow);
        assert_eq!(cut.mesh.triangles[1..3], [[0, 1, 2], [0, 2, 3]], "a fan, since nothing is better");
        let note =
            "which side is inside in polygons that cross themselves (1, the first is face 2, counted from 1)";
        assert_eq!((cut.polygons, &cut.notes[..]), (2, &[note.to_owned()][..]));
    }
}
