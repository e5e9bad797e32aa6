// Before anything is painted: the theme and text size chosen last, else what the system prefers.
(() => {
  const root = document.documentElement;
  const system = window.matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark';
  const wanted = new URLSearchParams(location.search).get('theme');
  root.dataset.theme = wanted || localStorage.getItem('theme') || system;
  root.dataset.text = localStorage.getItem('text') || 'normal';
})();
