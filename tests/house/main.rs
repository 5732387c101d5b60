//! Of the house: imports, sizes, what is documented and what is claimed.

#[path = "../common/sources.rs"]
mod sources;

mod api;
mod architecture;
mod claims;
mod constants;
mod references;
