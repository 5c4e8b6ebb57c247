//! Where each candidate would go: which vertices may be removed now, and to which neighbour the surface is changed least.

use super::integer::{cross, dot, keeps_side, key, magnitude, minus, normal, shift_of, shifted};
use super::snapshot::{Fan, Neighbour, Snapshot};
use super::{Guard, Rule};

/// Where a vertex would go, and what that costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Move {
    /// [`NOWHERE`], or a neighbour.
    pub(super) target: u32,
    pub(super) key: u32,
}

/// No target.
pub(super) const NOWHERE: u32 = u32::MAX;

impl Move {
    pub(super) const NONE: Self = Self { target: NOWHERE, key: 0 };
}

impl Snapshot<'_> {
    /// Whether a vertex has a neighbour that stays.
    pub(super) fn is_near(&self, v: u32) -> bool {
        self.corners(v).any(|w| !self.selected[w as usize])
    }

    /// Whether a selected vertex may be removed now: beside one that stays, or beside an auxiliary one that is no candidate itself
    /// because it has none beside it (rule of 2016).
    pub(super) fn is_candidate(&self, v: u32, near: &[bool], rule: Rule) -> bool {
        let waits = |x: u32| self.selected[x as usize] && self.auxiliary[x as usize] && !near[x as usize];
        near[v as usize]
            || rule == Rule::Of2016
                && !self.auxiliary[v as usize]
                && self.corners(v).any(|x| x != v && waits(x))
    }

    /// Whether a candidate may go to a neighbour, as far as it is for those two to say.
    fn is_open(&self, v: u32, neighbour: Neighbour, candidates: &[bool], rule: Rule) -> bool {
        let r = neighbour.vertex as usize;
        let stays = match rule {
            Rule::Of2015 => !self.selected[r],
            Rule::Of2016 => !candidates[r],
        };
        // Along a boundary its vertices may move, not away from it.
        stays && (neighbour.triangles == 1 || !self.boundary[v as usize])
    }

    /// The cheapest neighbour to which a candidate can go while all others stay.
    pub(super) fn propose(
        &self,
        v: u32,
        candidates: &[bool],
        rule: Rule,
        guard: Guard,
        memory: &mut Memory,
    ) -> Move {
        let Memory { fan, choices, .. } = memory;
        fan.gather(v, self);
        self.price(v, fan, choices, |n| self.is_open(v, n, candidates, rule));
        choices.sort_unstable();
        for k in 0..memory.choices.len() {
            let (key, target) = memory.choices[k];
            let holds = self.is_linked(target, &memory.fan)
                && match guard {
                    Guard::Blind => self.holds_blindly(target, candidates, rule, memory),
                    Guard::Veto | Guard::Independent => self.holds(v, target, &memory.fan),
                };
            if holds {
                return Move { target, key };
            }
        }
        Move::NONE
    }

    /// What each open way costs: how far the target is off the triangles of the vertex, times their areas.
    fn price(&self, v: u32, fan: &Fan, choices: &mut Vec<(u32, u32)>, is_open: impl Fn(Neighbour) -> bool) {
        let at = |w: u32| minus(self.points[w as usize], self.points[v as usize]);
        let shift = shift_of(fan.neighbours.iter().fold(0, |most, n| most | magnitude(at(n.vertex))));
        let near = |w: u32| shifted(at(w), shift);
        choices.clear();
        for &n in fan.neighbours.iter().filter(|n| is_open(**n)) {
            let to = near(n.vertex);
            let off = |&[a, b]: &[u32; 2]| dot(cross(near(a), near(b)), to).unsigned_abs();
            choices.push((key(fan.wings.iter().map(off).sum(), 3 * shift), n.vertex));
        }
    }

    /// The link condition: the two have no neighbour in common but those in their common triangles.
    fn is_linked(&self, target: u32, fan: &Fan) -> bool {
        let is_opposite = |w: u32| fan.wings.contains(&[target, w]) || fan.wings.contains(&[w, target]);
        self.corners(target).all(|w| w == target || !fan.has(w) || is_opposite(w))
    }

    /// Whether no triangle turns over.
    fn holds(&self, v: u32, target: u32, fan: &Fan) -> bool {
        let at = |w: u32| self.points[w as usize];
        fan.wings
            .iter()
            .filter(|wing| !wing.contains(&target))
            .all(|&[a, b]| keeps_side(normal(at(v), at(a), at(b)), normal(at(target), at(a), at(b))))
    }

    /// Whether no triangle turns over, whatever the other candidates do.
    fn holds_blindly(&self, target: u32, candidates: &[bool], rule: Rule, memory: &mut Memory) -> bool {
        let Memory { fan, other, ways, .. } = memory;
        let at = |w: u32| self.points[w as usize];
        let v = fan.vertex;
        fan.wings.iter().filter(|wing| !wing.contains(&target)).all(|&wing| {
            let old = normal(at(v), at(wing[0]), at(wing[1]));
            for (ways, x) in ways.iter_mut().zip(wing) {
                ways.clear();
                ways.push(x);
                if candidates[x as usize] {
                    other.gather(x, self);
                    let open = other.neighbours.iter().filter(|n| self.is_open(x, **n, candidates, rule));
                    ways.extend(open.map(|n| n.vertex));
                }
            }
            let [first, second] = &*ways;
            // More ways than these are not gone through.
            first.len() * second.len() <= MOST_WAYS
                && first.iter().all(|&a| {
                    second.iter().all(|&b| {
                        let vanishes = a == b || a == target || b == target;
                        vanishes || keeps_side(old, normal(at(target), at(a), at(b)))
                    })
                })
        })
    }
}

/// Memory that a thread uses again.
#[derive(Debug, Default)]
pub(super) struct Memory {
    fan: Fan,
    other: Fan,
    choices: Vec<(u32, u32)>,
    ways: [Vec<u32>; 2],
}

/// Pairs of ways of a triangle's two other corners that [`Guard::Blind`] looks at.
const MOST_WAYS: usize = 256;
