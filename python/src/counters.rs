//! What a step did, as a dict.

use foible3d::DeformableCounters;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// All counters by their names; times in seconds.
pub fn as_dict<'py>(py: Python<'py>, counters: &DeformableCounters) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    macro_rules! tell {
        ($($name:ident)*; $($time:ident)*) => {
            $(told.set_item(stringify!($name), counters.$name)?;)*
            $(told.set_item(stringify!($time), counters.$time.as_secs_f64())?;)*
        };
    }
    tell!(bodies sleeping islands obstacles pairs contacts active_contacts neighbourhood_constraints iterations
        not_converged guard_retries elements solves solve_bytes newton_steps contact_sweeps contact_products
        budgets_reached contact_error contact_factorizations contact_failures factorizations columns factor_bytes
        column_bytes rejected_steps quarantined skipped;
        detection_time factor_time solve_time element_time linear_time contact_time advance_time);
    told.set_item("total_time", counters.total_time().as_secs_f64())?;
    Ok(told)
}
