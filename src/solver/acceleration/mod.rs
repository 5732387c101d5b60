//! What makes of the plain iteration a faster one, chosen per body.

mod anderson;
mod chebyshev;
mod lbfgs;

mod accelerator;

pub(crate) use accelerator::Accelerator;
