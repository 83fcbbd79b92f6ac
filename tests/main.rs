//! What the library promises, a module a subject.

mod raster;
