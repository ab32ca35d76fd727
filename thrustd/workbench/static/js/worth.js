// Whether a candidate is worth a button: what it removes, by the numbers of the diagnosis.
export const WORTH = 0.01; // of the squared error; less shows in no printed digit

export const removed = (c) => Math.max(0, 1 - (c.rmse_after_n / c.rmse_before_n) ** 2);
