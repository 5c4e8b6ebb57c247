//! Components born at a level: whole ones that join the mesh behind the level's operations (spec §7.4).

use super::operation::OperationError;
use crate::mesh::{Corner, CornerTable, Triangle, Vertex};

/// All that is born at one level, as a mesh of its own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Birth {
    /// Its triangles, none of which has been removed.
    pub table: CornerTable,
    /// The number of each of its vertices in the mesh that it joins.
    pub vertices: Vec<Vertex>,
}

impl Birth {
    /// Takes components out of a mesh, all triangles of which are `triangles`. In this order they will stand.
    pub fn take(table: &mut CornerTable, triangles: &[Triangle]) -> Self {
        let mut places = vec![Triangle::NONE; table.slots()];
        for (k, t) in (0..).zip(triangles) {
            places[t.index()] = Triangle(k);
        }
        let moved = |c: Corner| {
            if c.is_none() { c } else { places[c.triangle().index()].corner(c.place() as u32) }
        };
        let mut names = vec![Vertex::NONE; table.vertex_slots()];
        let mut vertices = Vec::new();
        let mut name = |v: Vertex| {
            let name = &mut names[v.index()];
            if name.is_none() {
                *name = Vertex(vertices.len() as u32);
                vertices.push(v);
            }
            *name
        };
        let of_triangle =
            |&t: &Triangle| (table.triangle(t).map(&mut name), table.opposites_from(t.corner(0)).map(moved));
        let parts: Vec<_> = triangles.iter().map(of_triangle).collect();
        table.remove_components(triangles.iter().copied());
        Self { table: CornerTable::collect(vertices.len(), parts.len(), parts.into_iter()), vertices }
    }

    /// The number that a vertex of [`Birth::table`] has in the mesh.
    pub fn name(&self, v: Vertex) -> Vertex {
        self.vertices[v.index()]
    }

    /// It joins the mesh.
    pub fn apply(&self, table: &mut CornerTable) {
        table.append(&self.table, |v| self.name(v));
    }

    /// It leaves the mesh, which has it as it was born.
    ///
    /// # Errors
    /// [`OperationError::Vertex`] where a vertex of it is missing.
    pub fn undo(&self, table: &mut CornerTable) -> Result<(), OperationError> {
        let mut triangles = Vec::with_capacity(self.table.triangle_count());
        for &v in &self.vertices {
            if v.index() >= table.vertex_slots() || table.corner_of(v).is_none() {
                return Err(OperationError::Vertex(v));
            }
            triangles.extend(table.fan(v).map(|c| c.triangle()));
        }
        triangles.sort_unstable();
        triangles.dedup();
        table.remove_components(triangles.into_iter());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    /// Two sheets and a sphere between them in one table; the sphere and a sheet leave, and come back.
    #[test]
    fn what_is_taken_comes_back() {
        let (sheet, ball) = (shapes::grid(3, 2), shapes::sphere(1));
        let mut triangles = Vec::new();
        let mut count = 0;
        for mesh in [&sheet, &ball, &sheet] {
            triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + count)));
            count += mesh.positions.len() as u32;
        }
        let whole = CornerTable::from_triangles(count as usize, &triangles).unwrap();
        let mut table = whole.clone();
        let first = sheet.triangles.len();
        let going: Vec<_> = whole.triangles().skip(first).collect();
        let birth = Birth::take(&mut table, &going);
        assert_eq!((table.check(), birth.table.check()), (Ok(()), Ok(())));
        assert_eq!(table.triangle_count(), first);
        assert_eq!(birth.vertices.len(), ball.positions.len() + sheet.positions.len());
        let without = table.clone();
        birth.apply(&mut table);
        assert_eq!(table, whole, "they stood at the end, in this order");
        birth.undo(&mut table).unwrap();
        assert_eq!(table.triangle_count(), without.triangle_count());
        assert!(birth.undo(&mut table).is_err());
    }
}
