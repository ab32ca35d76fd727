// How large letters and pictures are drawn: one where the style sheet says 13 px, more on a projector.
export const SCALE = parseFloat(getComputedStyle(document.documentElement).fontSize) / 13;
export const FAMILY = "Inter, 'Segoe UI', system-ui, 'DejaVu Sans', sans-serif";
export const px = (size) => Math.round(size * SCALE);
