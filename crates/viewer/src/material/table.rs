//! The tables of attenuation coefficients and anode spectra, read once from the files in this folder.
//!
//! Between the entries attenuation nearly follows power laws of the energy, so ln μ is interpolated linearly in ln E.
//! A repeated energy is a K-edge: the interval before it ends at the lower value, the one after it begins at the
//! upper.

use std::sync::LazyLock;

/// Values by energy: one column for each name.
#[derive(Debug)]
pub(crate) struct Table {
    pub(crate) energies_kev: Vec<f64>,
    names: Vec<&'static str>,
    /// Values of column c at energy e: `values[c][e]`.
    values: Vec<Vec<f64>>,
}

impl Table {
    fn parse(text: &'static str) -> Self {
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let names: Vec<&str> = lines.next().unwrap_or_default().split(',').skip(1).collect();
        let mut table = Self { energies_kev: vec![], values: vec![vec![]; names.len()], names };
        for line in lines {
            // The files are part of the program; a test reads all of their numbers.
            let mut numbers = line.split(',').map(|word| word.parse().unwrap_or(f64::NAN));
            table.energies_kev.extend(numbers.next());
            table.values.iter_mut().zip(numbers).for_each(|(column, value)| column.push(value));
        }
        table
    }

    /// The column with this name.
    pub(crate) fn column(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| *n == name).map(|i| self.values[i].as_slice())
    }

    /// Names of the columns.
    pub(crate) fn names(&self) -> &[&'static str] {
        &self.names
    }

    /// Lowest and highest energy.
    pub(crate) fn range_kev(&self) -> [f64; 2] {
        [self.energies_kev[0], self.energies_kev[self.energies_kev.len() - 1]]
    }

    /// Value of `column` at an energy within [`Self::range_kev`], by a power law between the entries.
    pub(crate) fn at(&self, column: &[f64], energy_kev: f64) -> f64 {
        // The last entry not above the energy: at an edge, the upper one.
        let after = self.energies_kev.partition_point(|&e| e <= energy_kev);
        let i = after.clamp(1, self.energies_kev.len() - 1) - 1;
        let (e0, e1) = (self.energies_kev[i], self.energies_kev[i + 1]);
        let w = libm::log(energy_kev / e0) / libm::log(e1 / e0);
        libm::exp(libm::log(column[i]) * (1.0 - w) + libm::log(column[i + 1]) * w)
    }

    /// The K-edges: repeated energies.
    pub(crate) fn edges_kev(&self) -> Vec<f64> {
        self.energies_kev.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect()
    }
}

/// Linear attenuation coefficients in 1/cm.
pub(crate) static ATTENUATION: LazyLock<Table> =
    LazyLock::new(|| Table::parse(include_str!("data/attenuation.csv")));

/// Mass energy-absorption coefficient of dry air in cm²/g, which defines air kerma.
pub(crate) static AIR: LazyLock<Table> = LazyLock::new(|| Table::parse(include_str!("data/air.csv")));

/// Photons of a tungsten anode in bins that end at K-edges, by peak voltage, unfiltered.
pub(crate) static ANODE: LazyLock<Table> =
    LazyLock::new(|| Table::parse(include_str!("data/tungsten_anode.csv")));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_hold_finite_numbers_at_rising_energies() {
        for table in [&*ATTENUATION, &*ANODE, &*AIR] {
            assert!(table.energies_kev.len() >= 10 && table.energies_kev.is_sorted());
            for (name, column) in table.names.iter().zip(&table.values) {
                assert_eq!(column.len(), table.energies_kev.len(), "{name}");
                assert!(column.iter().all(|v| v.is_finite() && *v >= 0.0), "{name}");
            }
        }
        assert!(ATTENUATION.values.iter().flatten().all(|v| *v > 0.0));
        assert_eq!(ATTENUATION.edges_kev().len(), 5, "I, Cs, Ba, W and Pt");
        let [low, high] = ATTENUATION.range_kev();
        assert!(AIR.range_kev()[0] <= low && AIR.range_kev()[1] >= high);
    }

    #[test]
    fn edges_jump_and_everything_else_is_continuous() {
        let tungsten = ATTENUATION.column("tungsten").unwrap();
        let at = |e| ATTENUATION.at(tungsten, e);
        assert!(at(69.525) / at(69.524) > 3.0);
        assert!((at(69.53) / at(69.525) - 1.0).abs() < 1e-3);
        assert!((at(60.0) / 10.0 - 7.2).abs() < 0.05, "{}", at(60.0));
        // Half way between entries on the logarithmic scale lies the geometric mean.
        let between = at((40.0_f64 * 42.0).sqrt());
        assert!((between / (at(40.0) * at(42.0)).sqrt() - 1.0).abs() < 1e-12);
    }
}
