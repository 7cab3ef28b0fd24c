// Before the first paint: dark or light, and room for the panel, which do not change later.
if (matchMedia("(prefers-color-scheme: light)").matches) document.documentElement.dataset.tone = "light";
document.documentElement.classList.toggle("unfolded", innerWidth >= 900);
document.documentElement.classList.toggle("bare", /[#&]panel=0(&|$)/.test(location.hash));
