//! Which closed ways through spheres go around an obstacle.
//!
//! Spheres that overlap, in pairs and in triples, are a complex with the rings of the lumen. Each pair is given a set
//! of letters such that around every triple each letter is met an even number of times: then a closed way that can be
//! drawn together to a point meets each letter an even number of times, and the letters that it meets an odd number
//! of times name the rings that it goes around (a basis of the first cohomology over two elements; Busaryev, Cabello,
//! Chen, Dey and Wang, "Annotating simplices with a homology basis and its applications", SWAT 2012).
//!
//! Spheres are added one after the other. A new sphere that meets earlier ones which do not meet each other there may
//! close a ring: a new letter. If a triple says that some letters cancel, the youngest of them is replaced by the
//! others.

use super::ways::{Beside, Ways};

/// Letters at the same time: more are a sponge, not a vessel.
const MOST_LETTERS: u32 = 128;

/// A set of letters.
pub(super) type Class = u128;

/// The letters between all overlapping spheres, such that there are none along the cheapest ways from the first.
pub(super) struct Classes {
    /// For each sphere those beside it, ascending, with the class of the step.
    beside: Vec<Vec<(usize, Class)>>,
}

/// The letters in use, and when each was first used.
struct Letters {
    used: Class,
    born: [usize; MOST_LETTERS as usize],
    count: usize,
}

impl Letters {
    fn take(&mut self) -> Option<Class> {
        let free = self.used.trailing_ones();
        if free == MOST_LETTERS {
            return None;
        }
        self.used |= 1 << free;
        self.count += 1;
        self.born[free as usize] = self.count;
        Some(1 << free)
    }

    /// The youngest letter of a class that is not empty.
    fn youngest(&self, class: Class) -> Class {
        let letters = (0..MOST_LETTERS).filter(|letter| class >> letter & 1 == 1);
        letters.max_by_key(|letter| self.born[*letter as usize]).map_or(0, |letter| 1 << letter)
    }
}

impl Classes {
    /// The classes of the spheres that `ways` reaches; `None` for a lumen full of holes.
    pub(super) fn new(beside: &Beside, ways: &Ways) -> Option<Self> {
        let order = ways.order();
        let mut rank = vec![usize::MAX; beside.0.len()];
        order.iter().enumerate().for_each(|(at, sphere)| rank[*sphere] = at);
        let mut steps: Vec<Vec<(usize, Class)>> = vec![Vec::new(); beside.0.len()];
        let mut letters = Letters { used: 0, born: [0; MOST_LETTERS as usize], count: 0 };
        // Place of each earlier neighbour of the current sphere among them.
        let mut place = vec![usize::MAX; beside.0.len()];
        for (at, &sphere) in order.iter().enumerate() {
            let mut earlier: Vec<usize> =
                beside.0[sphere].iter().copied().filter(|other| rank[*other] < at).collect();
            earlier.sort_unstable_by_key(|other| rank[*other]);
            earlier.dedup();
            earlier.iter().enumerate().for_each(|(k, other)| place[*other] = k);
            let mut own: Vec<Option<Class>> = vec![None; earlier.len()];
            for start in 0..earlier.len() {
                if own[start].is_some() {
                    continue;
                }
                own[start] = Some(if start == 0 { 0 } else { letters.take()? });
                let mut open = vec![start];
                while let Some(k) = open.pop() {
                    for n in 0..steps[earlier[k]].len() {
                        let (other, step) = steps[earlier[k]][n];
                        let j = place[other];
                        if j == usize::MAX {
                            continue;
                        }
                        let through = own[k].unwrap_or(0) ^ step;
                        match own[j] {
                            None => {
                                own[j] = Some(through);
                                open.push(j);
                            }
                            Some(known) if known == through => {}
                            Some(known) => {
                                let none = known ^ through;
                                let letter = letters.youngest(none);
                                letters.used &= !letter;
                                let all = steps.iter_mut().flatten().map(|step| &mut step.1);
                                all.chain(own.iter_mut().flatten())
                                    .filter(|class| **class & letter != 0)
                                    .for_each(|class| *class ^= none);
                            }
                        }
                    }
                }
            }
            for (&other, class) in earlier.iter().zip(own) {
                place[other] = usize::MAX;
                let class = class.unwrap_or(0);
                steps[sphere].push((other, class));
                steps[other].push((sphere, class));
            }
        }
        let mut along = vec![0; steps.len()];
        for &sphere in order {
            let from = ways.before(sphere).unwrap_or(sphere);
            let step = steps[sphere].iter().find(|(other, _)| *other == from).map_or(0, |step| step.1);
            along[sphere] = along[from] ^ step;
        }
        for (sphere, beside) in steps.iter_mut().enumerate() {
            beside.sort_unstable_by_key(|(other, _)| *other);
            beside.iter_mut().for_each(|(other, class)| *class ^= along[sphere] ^ along[*other]);
        }
        Some(Self { beside: steps })
    }

    /// Pairs of spheres whose cheapest ways from the first close a ring with the step between them: one pair for each
    /// independent ring, the cheapest.
    pub(super) fn rings(&self, ways: &Ways) -> Vec<[usize; 2]> {
        let pairs = self.beside.iter().enumerate().flat_map(|(a, beside)| {
            beside
                .iter()
                .filter(move |(b, class)| a < *b && *class != 0)
                .map(move |(b, class)| (a, *b, *class))
        });
        let mut pairs: Vec<(f64, usize, usize, Class)> =
            pairs.map(|(a, b, class)| (ways.cost(a) + ways.cost(b), a, b, class)).collect();
        pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        // Classes of the rings so far, each with a highest letter of its own.
        let mut known: Vec<Class> = Vec::new();
        let mut rings = Vec::new();
        for (_, a, b, class) in pairs {
            let rest = known.iter().fold(class, |rest, other| rest.min(rest ^ other));
            if rest != 0 {
                known.push(rest);
                known.sort_unstable_by(|x, y| y.cmp(x));
                rings.push([a, b]);
            }
        }
        rings
    }

    /// The class of a step, or of two, from one sphere to another; `None` if they are farther apart.
    pub(super) fn between(&self, a: usize, b: usize) -> Option<Class> {
        if a == b {
            return Some(0);
        }
        let step = |a: usize, b: usize| {
            let found = self.beside[a].binary_search_by_key(&b, |(other, _)| *other).ok()?;
            Some(self.beside[a][found].1)
        };
        step(a, b).or_else(|| self.beside[a].iter().find_map(|&(over, first)| Some(first ^ step(over, b)?)))
    }
}
