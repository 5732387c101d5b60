//! Which factors are forgotten. None of it changes a result: what is gone is made again with the same bits.

use super::factor_cache::FactorCache;

/// Steps after which unused factors are dropped, for all steps of a body together: two seconds at game speed.
const UNUSED_STEPS: u64 = 120;
/// Unused bodies' factors that are kept at all.
const MAX_UNUSED: usize = 8;
/// Factors that differ by their step alone which are kept: random ones between 1/144 and 1/30 s want six.
pub(crate) const STEPS_KEPT: usize = 8;

impl FactorCache {
    /// A material that changes all the time must not fill the memory with old factors; a step that does comes back to
    /// those of its family.
    pub(super) fn forget_unused(&mut self) {
        let now = self.step;
        if self.factors.iter().all(|f| f.last_used + 1 >= now) {
            return;
        }
        // The latest use of every family, the latest first.
        self.ages.clear();
        self.ages.extend(self.factors.iter().map(|f| (f.family, f.last_used)));
        self.ages.sort_unstable_by_key(|&(family, used)| (family, std::cmp::Reverse(used)));
        self.ages.dedup_by_key(|(family, _)| *family);
        self.ages.sort_unstable_by_key(|&(_, used)| std::cmp::Reverse(used));
        let in_use = self.ages.iter().take_while(|(_, used)| used + 1 >= now).count();
        self.ages.truncate(in_use + MAX_UNUSED);
        let oldest = now.saturating_sub(UNUSED_STEPS);
        self.ages.retain(|(_, used)| *used >= oldest);
        self.ages.sort_unstable();
        let (ages, before) = (&self.ages, self.factors.len());
        self.factors.retain(|f| ages.binary_search_by_key(&f.family, |(family, _)| *family).is_ok());
        if self.factors.len() < before {
            self.find_places();
        }
    }

    /// Where a factor of a family may take the place of another: of one not used in this step, if there are many.
    pub(super) fn outlived(&self, family: u64) -> Option<usize> {
        let own = || self.factors.iter().enumerate().filter(|(_, f)| f.family == family);
        let unused = own().filter(|(_, f)| f.last_used < self.step);
        let oldest = unused.min_by_key(|(_, f)| f.last_used).map(|(place, _)| place);
        oldest.filter(|_| own().count() >= STEPS_KEPT)
    }

    fn find_places(&mut self) {
        self.places.clear();
        self.places.extend(self.factors.iter().enumerate().map(|(place, f)| (f.key.clone(), place)));
        self.symbolic.retain(|(model, ..), _| self.factors.iter().any(|f| f.key.model == *model));
    }
}
