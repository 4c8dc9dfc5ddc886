//! Typed images, masks, exposure stacks and their pictures.
