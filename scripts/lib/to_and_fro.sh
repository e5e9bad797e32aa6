# shellcheck shell=bash
# Makes a long sequence of a short one. Sourced.

# to_and_fro FROM SECONDS TO: plays the TUM RGB-D folder FROM forwards, backwards, forwards ... at its mean rate, as the folder TO
# with ascending stamps. The ground truth, where there is one, goes along: of each frame the pose nearest in time, within 20 ms.
to_and_fro() {
  mkdir -p "$3"
  ln -sfn "$(cd "$1" && pwd)/rgb" "$3/rgb"
  local truth=$1/groundtruth.txt
  [[ -f $truth ]] || truth=/dev/null
  awk -v seconds="$2" -v images="$3/rgb.txt" -v poses="$3/groundtruth.txt" -v truth="$truth" '
    function distance(i, t) { return at[i] > t ? at[i] - t : t - at[i] }
    /^#/ || NF < 2 { next }
    FILENAME == truth { at[m] = $1; pose[m++] = $2 " " $3 " " $4 " " $5 " " $6 " " $7 " " $8; next }
    { while (nearest + 1 < m && distance(nearest + 1, $1) <= distance(nearest, $1)) ++nearest
      if (m > 0 && distance(nearest, $1) < 0.02) of[n] = pose[nearest]
      stamp[n] = $1; file[n++] = $2 }
    BEGIN { m = n = nearest = 0 }
    END { period = (stamp[n - 1] - stamp[0]) / (n - 1); here = 0; step = 1
      for (i = 0; i * period < seconds; ++i) {
        printf "%.6f %s\n", 1 + i * period, file[here] >images
        if (here in of) printf "%.6f %s\n", 1 + i * period, of[here] >poses
        if (here + step < 0 || here + step >= n) step = -step
        here += step } }' "$truth" "$1/rgb.txt"
}
