//! Chapter 5.2: the atoms of a pass.

use std::cell::RefCell;
use std::collections::VecDeque;

use super::container::{Atom, Result, demand};
use super::entropy::{Code, Tap};

/// The atoms of a pass, one code after the other (§5.2).
pub struct Codes<'a> {
    atoms: VecDeque<&'a Atom>,
    /// That of the first of `atoms`.
    pub code: Code<'a>,
    tap: Option<&'a RefCell<Tap>>,
    /// What the first of `atoms` still lacks.
    items: u64,
    triangles: u64,
}

impl<'a> Codes<'a> {
    pub fn of(atoms: Vec<&'a Atom>, tap: Option<&'a RefCell<Tap>>) -> Self {
        let mut codes = Self { atoms: atoms.into(), code: Code::start(&[]), tap, items: 0, triangles: 0 };
        codes.open();
        codes
    }

    fn open(&mut self) {
        if let Some(atom) = self.atoms.front() {
            self.code =
                self.tap.map_or_else(|| Code::start(&atom.bytes), |tap| Code::tapped(&atom.bytes, tap));
            (self.items, self.triangles) = (atom.items, atom.triangles);
        }
    }

    /// Says that an item is complete, which added so many triangles.
    pub fn item(&mut self, triangles: u64) -> Result<()> {
        demand(triangles <= self.triangles, "5.2: triangles of an atom")?;
        self.triangles -= triangles;
        self.items -= 1;
        if self.items == 0 {
            demand(self.triangles == 0, "5.2: triangles of an atom")?;
            std::mem::replace(&mut self.code, Code::start(&[])).end()?;
            self.atoms.pop_front();
            self.open();
        }
        Ok(())
    }

    /// Whether the item under way is the last one of its atom.
    pub fn is_last(&self) -> bool {
        self.items == 1
    }

    pub fn complete(&self) -> bool {
        self.atoms.is_empty()
    }
}
