//! Surface normals from shading.
