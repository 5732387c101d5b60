//! JUnit's XML, which build servers read: a suite per scene, a test case per expectation.

use crate::baseline::Drift;
use crate::run::{Costs, Outcome};
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
use std::time::Duration;

/// As XML, of runs with what drifted in each.
///
/// # Errors
/// Text that XML cannot hold.
pub fn to_xml(runs: &[(&Outcome, &Costs, &[Drift])]) -> Result<String, String> {
    let mut report = Report::new("foible");
    for (outcome, costs, drifts) in runs {
        let mut suite = TestSuite::new(outcome.title());
        suite.set_time(Duration::from_secs_f64(costs.total * 1e-3));
        let failed = |kind, message: String| {
            let mut status = TestCaseStatus::non_success(kind);
            status.set_message(message);
            status
        };
        if let Some(error) = &outcome.error {
            suite.add_test_case(TestCase::new("runs", failed(NonSuccessKind::Error, error.clone())));
        }
        for verdict in &outcome.verdicts {
            let said = || {
                format!(
                    "{:e} {}, but wanted {}",
                    verdict.measured.value, verdict.measured.unit, verdict.wanted
                )
            };
            let status =
                if verdict.met { TestCaseStatus::success() } else { failed(NonSuccessKind::Failure, said()) };
            suite.add_test_case(TestCase::new(verdict.measured.name.clone(), status));
        }
        for drift in drifts.iter() {
            let message = super::text::of_drifts(std::slice::from_ref(drift)).trim().to_string();
            let name = format!("baseline of {}", drift.name);
            suite.add_test_case(TestCase::new(name, failed(NonSuccessKind::Failure, message)));
        }
        report.add_test_suite(suite);
    }
    report.to_string().map_err(|e| e.to_string())
}
