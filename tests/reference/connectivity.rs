//! Chapter 7.1: a closed surface, glued together from the last triangle on.

use super::container::{Result, demand};
use super::entropy::{Code, Model, Number};

/// Triangles glued along their edges: triangle t has the corners 3t, 3t + 1, 3t + 2.
#[derive(Default)]
pub struct Gluing {
    /// O, by corner.
    pub opposite: Vec<usize>,
    /// Corners of the components' first triangles, the last component first.
    pub starts: Vec<usize>,
}

pub fn next(c: usize) -> usize {
    c / 3 * 3 + (c + 1) % 3
}

pub fn prev(c: usize) -> usize {
    c / 3 * 3 + (c + 2) % 3
}

#[derive(Clone, Copy, PartialEq)]
enum Symbol {
    C,
    R,
    L,
    S,
    E,
}
use Symbol::{C, E, L, R, S};

struct Models {
    symbol: Vec<[[Model; 4]; 5]>,
    handle: Model,
    distance: Number,
    side: Model,
}

/// The state of §7.1; all arrays by edge, that is, by corner.
#[derive(Default)]
struct State {
    nxt: Vec<usize>,
    prv: Vec<usize>,
    open: Vec<bool>,
    count: Vec<usize>,
    opposite: Vec<usize>,
    stack: Vec<usize>,
}

impl State {
    fn link(&mut self, e: usize, f: usize) {
        self.nxt[e] = f;
        self.prv[f] = e;
        self.open[e] = true;
        self.open[f] = true;
    }

    fn glue(&mut self, e: usize, f: usize) {
        self.opposite[e] = f;
        self.opposite[f] = e;
        self.open[e] = false;
        self.open[f] = false;
    }
}

pub fn read(code: &mut Code, triangles: usize) -> Result<Gluing> {
    let mut models = Models {
        symbol: vec![[[Model::FRESH; 4]; 5]; 16],
        handle: Model::FRESH,
        distance: Number::FRESH,
        side: Model::FRESH,
    };
    let mut state = State::default();
    // Before the first symbol any value will do: the first one is not read.
    let mut last = E;
    let mut starts = Vec::new();
    for t in 0..triangles {
        let (gate, right, left) = (3 * t, 3 * t + 1, 3 * t + 2);
        for array in [&mut state.nxt, &mut state.prv, &mut state.opposite] {
            array.extend([usize::MAX; 3]);
        }
        state.open.extend([false; 3]);
        state.count.extend([1; 3]);
        let symbol = match state.stack.last() {
            None => E,
            Some(&active) => {
                let context = state.count[active].min(15);
                read_symbol(code, &mut models.symbol[context][last as usize])?
            }
        };
        let handle = if symbol == S { read_handle(code, &mut models)? } else { None };
        last = symbol;
        if symbol == E {
            state.link(gate, right);
            state.link(right, left);
            state.link(left, gate);
            state.stack.push(gate);
            continue;
        }
        add(&mut state, t, symbol, handle)?;
        let over = state.nxt[gate];
        if state.nxt[over] == gate {
            state.glue(gate, over);
            starts.push(gate);
            demand(!state.open.contains(&true) && state.stack.is_empty(), "7.1: a component left open")?;
        } else {
            state.stack.push(gate);
        }
    }
    demand(!state.open.contains(&true), "7.1: an edge left open")?;
    Ok(Gluing { opposite: state.opposite, starts })
}

/// Glues triangle t to the active edge: all symbols but E.
fn add(state: &mut State, t: usize, symbol: Symbol, handle: Option<(u64, bool)>) -> Result<()> {
    let (gate, right, left) = (3 * t, 3 * t + 1, 3 * t + 2);
    let Some(a) = state.stack.pop() else { return demand(false, "7.1: empty stack") };
    demand(state.open[a], "7.1: the active edge is not open")?;
    let (before, after) = (state.prv[a], state.nxt[a]);
    match symbol {
        R => {
            state.count[gate] = state.count[a] + 1;
            state.count[after] += 1;
            state.glue(a, left);
            state.link(before, gate);
            state.link(gate, right);
            state.link(right, after);
        }
        L => {
            state.count[left] = state.count[a] + 1;
            state.count[after] += 1;
            state.glue(a, right);
            state.link(before, left);
            state.link(left, gate);
            state.link(gate, after);
        }
        _ => {
            let b = match handle {
                _ if symbol == C => before,
                None => state.stack.pop().ok_or("§7.1: empty stack")?,
                Some((distance, side)) => {
                    demand(distance > 0 && distance <= t as u64, "7.1: a handle's distance")?;
                    3 * (t - distance as usize) + if side { 2 } else { 1 }
                }
            };
            demand(b != a && b != after && state.open[b], "7.1: the other edge")?;
            let (before_b, after_b) = (state.prv[b], state.nxt[b]);
            state.count[gate] = state.count[b] + 1;
            state.count[after] += 1;
            if after_b != a {
                demand(after_b != before, "7.1: a loop of one edge")?;
                state.count[after_b] += state.count[a] + 1;
                state.link(before, after_b);
            }
            state.glue(a, right);
            state.glue(b, left);
            state.link(before_b, gate);
            state.link(gate, after);
        }
    }
    Ok(())
}

fn read_symbol(code: &mut Code, models: &mut [Model; 4]) -> Result<Symbol> {
    for (model, symbol) in models.iter_mut().zip([C, R, L, S]) {
        if code.read(model)? {
            return Ok(symbol);
        }
    }
    Ok(E)
}

fn read_handle(code: &mut Code, models: &mut Models) -> Result<Option<(u64, bool)>> {
    if !code.read(&mut models.handle)? {
        return Ok(None);
    }
    let distance = code.unsigned(&mut models.distance)?;
    let side = code.read(&mut models.side)?;
    Ok(Some((distance, side)))
}
