//! Surfaces that lie over each other and are not of each other: the nearest point of one says nothing of another.

use crate::mesh::Vertex;

/// Which vertices of the input are of which body.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bodies {
    /// By vertex; empty where all are of one.
    of: Vec<u32>,
    /// The vertices of one body after the other, in order.
    members: Vec<Vertex>,
    /// Where the members of each body begin, and where the last one's end.
    begins: Vec<usize>,
}

impl Bodies {
    /// Of the body of each vertex, bodies being numbered from 0.
    pub fn new(of: Vec<u32>) -> Self {
        if of.iter().all(|&body| body == of[0]) {
            return Self::default();
        }
        let count = of.iter().max().map_or(0, |&most| most as usize + 1);
        let mut begins = vec![0; count + 1];
        of.iter().for_each(|&body| begins[body as usize + 1] += 1);
        (1..begins.len()).for_each(|k| begins[k] += begins[k - 1]);
        let mut next = begins.clone();
        let mut members = vec![Vertex(0); of.len()];
        for (v, &body) in (0..).zip(&of) {
            let place = &mut next[body as usize];
            members[*place] = Vertex(v);
            *place += 1;
        }
        Self { of, members, begins }
    }

    /// The body of a vertex, and how many vertices it has, of `count` in all.
    pub fn around(&self, v: Vertex, count: usize) -> Body<'_> {
        match self.of.get(v.index()) {
            Some(&body) => {
                let members = &self.members[self.begins[body as usize]..self.begins[body as usize + 1]];
                Body { members: Some(members), count: members.len() }
            }
            None => Body { members: None, count },
        }
    }
}

/// The vertices of a body.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// `None` where they are all there are.
    members: Option<&'a [Vertex]>,
    count: usize,
}

impl<'a> Body<'a> {
    /// About so many of them from all over, or all.
    pub fn some(self, most: usize) -> impl Iterator<Item = Vertex> + 'a {
        let vertex = move |k: usize| self.members.map_or(Vertex(k as u32), |members| members[k]);
        (0..self.count).step_by(self.count.div_ceil(most).max(1)).map(vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_of_a_body() {
        let bodies = Bodies::new(vec![0, 2, 0, 2, 2, 0]);
        let some = |v: u32, most| bodies.around(Vertex(v), 6).some(most).map(|v| v.0).collect::<Vec<_>>();
        assert_eq!(some(1, 9), [1, 3, 4]);
        assert_eq!(some(5, 9), [0, 2, 5]);
        assert_eq!(some(5, 2), [0, 5]);
        let one = Bodies::new(vec![3; 4]);
        assert_eq!(one, Bodies::default());
        assert_eq!(one.around(Vertex(2), 4).some(2).collect::<Vec<_>>(), [Vertex(0), Vertex(2)]);
    }
}
