// The range of values that a panel shows.

export function padded(low, high) {
  if (low === null || high === null || !Number.isFinite(low)) return [0, 1];
  if (low === high) {
    const room = Math.abs(low) * 0.05 || 1;
    return [low - room, high + room];
  }
  const room = 0.06 * (high - low);
  return [low - room, high + room];
}

// lowest and highest from a time on, over what is in sight: the start-up does not set the scale of a residual
export function settled(u, from_s, [start, stop]) {
  if (from_s === undefined || stop <= from_s || start >= from_s) return null;
  const [time, ...lines] = u.data;
  let low = Infinity,
    high = -Infinity;
  for (const values of lines)
    for (let i = 0; i < time.length; i++) {
      if (time[i] < from_s || time[i] > stop || values[i] === null || values[i] === undefined) continue;
      low = Math.min(low, values[i]);
      high = Math.max(high, values[i]);
    }
  return low < high ? [low, high] : null;
}
