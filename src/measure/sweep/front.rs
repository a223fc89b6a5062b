//! The Pareto front of time and error, when both are known with an uncertainty only.

/// Standard errors that a difference has to exceed: 95 % of a normal distribution lies within.
const SIGNIFICANT: f64 = 1.96;

/// What a difference has to exceed besides its uncertainty, as parts of the value.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Least {
    /// Of the time.
    pub time: f64,
    /// Of the error.
    pub error: f64,
}

/// A setting as the front sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Logarithm of the time.
    pub log_time: f64,
    /// Its standard error.
    pub log_time_error: f64,
    /// Squared relative errors of blocks of the images; the same blocks in the same order for all candidates.
    pub squared_errors: Vec<f64>,
}

impl Candidate {
    /// Root of the mean squared error; 0 where noise leaves less than nothing.
    pub fn error(&self) -> f64 {
        (self.squared_errors.iter().sum::<f64>() / self.squared_errors.len() as f64).max(0.0).sqrt()
    }

    /// Logarithm of the other's time over this one's, and its standard error.
    fn gain_of_time(&self, other: &Candidate) -> [f64; 2] {
        [other.log_time - self.log_time, self.log_time_error.hypot(other.log_time_error)]
    }

    /// Mean of the other's squared errors less this one's, and its standard error: block by block, since both show the same
    /// and have the same reference with the same noise. One block tells nothing.
    fn gain_of_error(&self, other: &Candidate) -> [f64; 2] {
        let n = self.squared_errors.len().min(other.squared_errors.len()) as f64;
        let gains = || other.squared_errors.iter().zip(&self.squared_errors).map(|(o, s)| o - s);
        let mean = gains().sum::<f64>() / n;
        let variance = gains().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0);
        [mean, if n >= 2.0 { (variance / n).sqrt() } else { f64::INFINITY }]
    }

    /// It takes significantly less time.
    pub fn is_faster(&self, other: &Candidate, least: Least) -> bool {
        let [gain, error] = self.gain_of_time(other);
        gain > SIGNIFICANT * error && gain > least.time
    }

    /// Its error is significantly less.
    pub fn is_closer(&self, other: &Candidate, least: Least) -> bool {
        let [gain, error] = self.gain_of_error(other);
        gain > SIGNIFICANT * error && self.error() < (1.0 - least.error) * other.error()
    }

    /// It surely takes no more time, but for less than matters.
    fn is_no_slower(&self, other: &Candidate, least: Least) -> bool {
        let [gain, error] = self.gain_of_time(other);
        gain - SIGNIFICANT * error > -least.time
    }

    /// Its error is surely no larger, but for less than matters.
    fn is_no_farther(&self, other: &Candidate, least: Least) -> bool {
        let [gain, error] = self.gain_of_error(other);
        // Of the error, not of its square.
        gain - SIGNIFICANT * error >= -2.0 * least.error * other.error().powi(2)
    }

    /// It is significantly better in both; or in one, and surely no worse in the other.
    pub fn dominates(&self, other: &Candidate, least: Least) -> bool {
        let (faster, closer) = (self.is_faster(other, least), self.is_closer(other, least));
        (faster && (closer || self.is_no_farther(other, least)))
            || (closer && self.is_no_slower(other, least))
    }
}

/// For each candidate who dominates it, `None` on the front: a candidate is on the front unless another
/// is significantly better in both, or in one and surely no worse in the other. Named is, of those that dominate it, one on the front if there is one, and of these the most accurate.
pub fn front(candidates: &[Candidate], least: Least) -> Vec<Option<usize>> {
    let dominating = |k: usize| {
        let all = 0..candidates.len();
        all.filter(move |q| candidates[*q].dominates(&candidates[k], least))
    };
    let dominated: Vec<bool> = (0..candidates.len()).map(|k| dominating(k).next().is_some()).collect();
    let order = |q: &usize| (dominated[*q], candidates[*q].error());
    (0..candidates.len())
        .map(|k| {
            dominating(k).min_by(|a, b| {
                let (a, b) = (order(a), order(b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LEAST: Least = Least { time: 0.03, error: 0.01 };

    /// A time, its relative error, and an error that is about the same in all blocks.
    fn candidate(time: f64, uncertain: f64, error: f64) -> Candidate {
        let blocks = (0..50).map(|k| error * error * (1.0 + 0.2 * f64::from(k % 5 - 2)));
        Candidate { log_time: time.ln(), log_time_error: uncertain, squared_errors: blocks.collect() }
    }

    #[test]
    fn who_is_better_in_both_dominates() {
        let all =
            [(1.0, 0.3), (2.0, 0.2), (3.0, 0.25), (4.0, 0.1), (5.0, 0.4)].map(|(t, e)| candidate(t, 0.01, e));
        // 3 ms is beaten by 2 ms; 5 ms by all that are faster, of which 4 ms is the most accurate.
        assert_eq!(front(&all, LEAST), [None, None, Some(1), None, Some(3)]);
        assert_eq!(front(&[], LEAST), []);
        assert_eq!(front(&all[..1], LEAST), [None]);
    }

    #[test]
    fn ties_are_all_on_the_front() {
        let same = candidate(1.0, 0.0, 0.2);
        assert_eq!(front(&[same.clone(), same.clone()], LEAST), [None, None]);
        // As fast and more accurate, or as accurate and faster.
        let all = [same.clone(), candidate(1.0, 0.0, 0.1), candidate(0.5, 0.0, 0.2)];
        assert_eq!(front(&all, LEAST), [Some(1), None, None]);
        // As fast as is known only within 10 %: it may be slower.
        assert_eq!(front(&[same, candidate(1.0, 0.05, 0.1)], LEAST), [None; 2]);
    }

    #[test]
    fn what_is_not_significant_does_not_dominate() {
        let (slow, fast) = (candidate(1.1, 0.0, 0.2), |u| candidate(1.0, u, 0.1));
        assert_eq!(front(&[slow.clone(), fast(0.01)], LEAST), [Some(1), None]);
        assert_eq!(front(&[slow.clone(), fast(0.2)], LEAST), [None, None]);
        // Significant, and too small to matter.
        assert_eq!(front(&[slow.clone(), candidate(1.08, 0.0, 0.1999)], LEAST), [None, None]);
        // Better in one block, worse in all others: the mean is better by chance.
        let mut lucky = slow.clone();
        lucky.log_time = 0.0;
        lucky.squared_errors.iter_mut().for_each(|e| *e *= 1.01);
        lucky.squared_errors[0] = -1.0;
        assert!(lucky.error() < 0.9 * slow.error());
        assert_eq!(front(&[slow.clone(), lucky], LEAST), [None, None]);
        // One block tells nothing.
        let one = |t: f64, e: f64| Candidate { log_time: t, log_time_error: 0.0, squared_errors: vec![e] };
        assert_eq!(front(&[one(1.0, 1.0), one(0.0, 0.1)], LEAST), [None, None]);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]

        #[test]
        fn the_front_is_never_empty_and_does_not_depend_on_order(
            points in proptest::collection::vec((0.1f64..10.0, 0.0f64..0.3, 0.01f64..1.0), 1..12)
        ) {
            let all: Vec<Candidate> = points.iter().map(|(t, u, e)| candidate(*t, *u, *e)).collect();
            let found = front(&all, LEAST);
            prop_assert!(found.contains(&None));
            let reversed: Vec<Candidate> = all.iter().rev().cloned().collect();
            let again: Vec<bool> = front(&reversed, LEAST).iter().rev().map(Option::is_none).collect();
            prop_assert_eq!(found.iter().map(Option::is_none).collect::<Vec<_>>(), again);
            for (k, q) in found.iter().enumerate() {
                if let Some(q) = q {
                    prop_assert!(all[*q].error() <= (1.0 + LEAST.error) * all[k].error());
                    prop_assert!(all[*q].log_time <= all[k].log_time + LEAST.time);
                }
            }
        }
    }
}
