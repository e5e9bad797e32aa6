#!/bin/sh
# A man page of what a program says with --help: man_page.sh PAGE.1.gz NAME VERSION COMMAND...
# Subcommands that the text lists get sections of their own.
set -eu
page=$1 name=$2 version=$3
shift 3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$@" --help >"$work/help" || { echo "man_page.sh: $* --help failed" >&2; exit 1; }

# Help text to roff. first=1: the page's head; else the section of a subcommand.
roff() { # FILE FIRST TITLE
  awk -v name="$name" -v version="$version" -v first="$2" -v title="$3" '
    function esc(s) { gsub(/\\/, "\\e", s); gsub(/-/, "\\-", s); if (s ~ /^[.\x27]/) s = "\\&" s; return s }
    function item(s,   at, term, rest) {
      sub(/^ +/, "", s)
      at = match(s, /  +/)
      if (s !~ /^-/ && at == 0) { print ".PP"; print esc(s); return }
      term = at ? substr(s, 1, at - 1) : s
      rest = at ? substr(s, at + RLENGTH) : ""
      if (!at && match(s, /[]}=][^ ]* [a-z]/) && s ~ /^--/) { term = substr(s, 1, RSTART + RLENGTH - 3); rest = substr(s, RSTART + RLENGTH - 1) }
      print ".TP"; print ".B " esc(term)
      if (rest != "") print esc(rest)
    }
    { sub(/\r$/, ""); line[NR] = $0 }
    END {
      n = NR
      for (i = 1; i <= n; ++i) if (line[i] ~ /^Usage: /) { usage = i; break }
      # What it is for: what stands before the usage, or the first words after it.
      for (i = 1; i < usage; ++i) if (line[i] != "") about = about (about == "" ? "" : " ") line[i]
      for (last = usage; last < n && line[last + 1] != ""; ++last) ;
      if (about == "") {
        for (i = last + 1; i <= n && line[i] == ""; ++i) ;
        for (; i <= n && line[i] != ""; ++i) words = words (words == "" ? "" : " ") line[i]
        about = words
      }
      whole = about
      if (match(about, /[.:;] /)) about = substr(about, 1, RSTART - 1)
      sub(/[.:]$/, "", about)
      if (first) {
        print ".TH " toupper(esc(name)) " 1 \"\" \"dmslam " version "\" \"User Commands\""
        print ".SH NAME"; print esc(name) " \\- " esc(about)
        print ".SH SYNOPSIS"
      } else { print ".SH " toupper(esc(title)); print esc(whole); print ".PP" }
      print ".nf"
      for (i = usage; i <= last; ++i) { s = line[i]; if (i == usage) sub(/^Usage: /, "", s); else sub(/^ +/, "", s); print ".B " esc(s) }
      print ".fi"
      if (first) { print ".SH DESCRIPTION"; if (usage > 1) print esc(whole) }
      for (i = last + 1; i <= n; ++i) {
        s = line[i]
        if (s == "") { if (i > last + 1) print ".PP" }
        else if (s ~ /^[A-Z][A-Za-z ]*:$/) { sub(/:$/, "", s); print ".SH " toupper(s) }
        else if (s ~ /^                /) { sub(/^ +/, "", s); print esc(s) }
        else if (s ~ /^  /) item(s)
        else print esc(s)
      }
    }' "$1"
}
{
  roff "$work/help" 1 ""
  for sub in $(sed -n '/^Subcommands:/,$s/^  \([a-z][a-z-]*\)  .*/\1/p' "$work/help"); do
    "$@" "$sub" --help >"$work/sub"
    roff "$work/sub" 0 "$sub"
  done
  printf '.SH SEE ALSO\nThe documents in /usr/share/doc/dmslam/docs.\n'
} | gzip -9n >"$page.part"
mv "$page.part" "$page"
