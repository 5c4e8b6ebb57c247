//! Contractions where attributes count: their price beside the planes', and seams.

use super::super::fit::{least, price, values};
use super::super::selection::Record;
use super::super::wedges::Sides;
use super::super::working::{DIRTY, Working};
use super::{Form, Pipeline, Quadric, Star};
use glam::DVec3;

impl Pipeline<'_> {
    /// As `proposal`: where a neighbour's position and values are off the planes and the functions of the vertex's own triangles. Nothing is
    /// proposed that would join what a seam parts.
    pub(super) fn proposal_with_attributes(&mut self, v: u32) -> Option<Record> {
        let Working { positions, triangles, flags, rings, wedges, .. } = &*self.working;
        let wedges = wedges.as_ref()?;
        let (star, fits) = (&mut self.pair.source, &mut self.fits[0]);
        star.gather(v, rings.of(v), triangles, positions, positions[v as usize]);
        wedges.fits(star, triangles, self.scheme.weights, fits);
        if fits.len() > 2 {
            // Where three meet there is no way along which all of them could go.
            return None;
        }
        wedges.spokes(star, triangles, &mut self.ends);
        let along = self.scheme.along_boundary && star.is_boundary();
        let star = &self.pair.source;
        let form = self.form(star);
        let mut choices = Vec::new();
        let mut best = Record { cost: f64::INFINITY, source: v, target: u32::MAX };
        for ends in self.ends.chunk_by(|x, y| x.vertex == y.vertex) {
            let (target, at) = (ends[0].vertex, ends[0].at);
            if flags[target as usize] & DIRTY != 0 || along && ends.len() != 1 {
                continue;
            }
            let Some(sides) = Sides::of(ends.iter().map(|end| end.wedges)) else { continue };
            if sides.pairs().len() != self.fits[0].len() {
                continue;
            }
            let of = |pair: &[u32; 2]| {
                self.fits[0].of(pair[0]).map_or(0.0, |fit| price(&[fit], at, wedges.row(pair[1])))
            };
            let cost = form.at(at).max(0.0) + sides.pairs().iter().map(of).sum::<f64>();
            if self.is_thorough {
                choices.push((cost, target));
            } else if cost < best.cost {
                best = Record { cost, target, ..best };
            }
        }
        if self.is_thorough {
            return self.thorough(v, choices);
        }
        (best.target != u32::MAX).then_some(best)
    }

    /// Whether the seams allow the contraction that has been gathered; then what the values cost, and whether the target has to rest.
    pub(super) fn joins(&mut self, extra: &mut Quadric, is_fixed: &mut bool) -> bool {
        let Working { triangles, wedges, .. } = &*self.working;
        self.sides = None;
        let Some(wedges) = wedges else { return true };
        let Some(sides) = wedges.sides(&self.pair, triangles) else { return false };
        *is_fixed |= wedges.rests(&self.pair.target, sides, triangles);
        if !*is_fixed {
            for (star, fits) in [&self.pair.source, &self.pair.target].into_iter().zip(&mut self.fits) {
                wedges.fits(star, triangles, self.scheme.weights, fits);
            }
            for &[source, target] in sides.pairs() {
                if let (Some(source), Some(target)) = (self.fits[0].of(source), self.fits[1].of(target)) {
                    *extra += least(&[source, target]);
                }
            }
        }
        self.sides = Some((sides, !*is_fixed));
        true
    }

    /// Joins the wedges of a contraction whose vertex goes to `place`, before the triangles change.
    pub(super) fn join(&mut self, place: DVec3) {
        let Working { triangles, wedges: Some(wedges), .. } = &mut *self.working else { return };
        let Some((sides, has_values)) = self.sides.take() else { return };
        let source = self.pair.source.vertex;
        self.pair.moved().for_each(|wing| wedges.join(wing.triangle, source, &sides, triangles));
        let is_nearer = place.length_squared() < place.distance_squared(self.pair.target.at);
        for &[source, target] in sides.pairs().iter().filter(|_| has_values) {
            if let (Some(one), Some(other)) = (self.fits[0].of(source), self.fits[1].of(target)) {
                wedges.change([source, target], values(&[one, other], place), is_nearer);
            }
        }
    }

    /// The planes of a star, with those that hold boundaries and seams.
    pub(super) fn form(&self, star: &Star) -> Form {
        let mut form = star.form(self.scheme.weights, self.scheme.boundary_planes);
        if let Some(wedges) = &self.working.wedges {
            form += wedges.seam_planes(star, &self.working.triangles, self.scheme.weights);
        }
        form
    }
}
