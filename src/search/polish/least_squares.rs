//! What is minimised.

/// A sum of squares to be minimised, whose Jacobian is handed over row by row.
pub trait LeastSquares {
    /// Calls `row(residual, gradient)` for every weighted residual at `candidate`, where `gradient[j]` is the
    /// derivative of the residual with respect to parameter `j` in its own unit. False if the simulation diverged.
    fn rows(&mut self, candidate: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool;

    /// The sum of the squares of the residuals that [`rows`](Self::rows) hands over at `candidate`, or `None` if the
    /// simulation diverged.
    fn cost(&mut self, candidate: &[f64]) -> Option<f64>;

    /// That of each of these candidates.
    fn costs(&mut self, candidates: &[Vec<f64>]) -> Vec<Option<f64>> {
        let mut costs = Vec::with_capacity(candidates.len());
        for candidate in candidates {
            costs.push(self.cost(candidate));
        }
        costs
    }

    /// That sum where it is at most `most`, otherwise `None`. Where a part of the sum is above it, the rest need not be known.
    fn cost_up_to(&mut self, candidate: &[f64], most: f64) -> Option<f64> {
        self.cost(candidate).filter(|cost| *cost <= most)
    }
}
