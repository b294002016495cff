(* The service rule ends: whoever is served moves after finitely many moves, where no set of places is crowded.

   To get the head of p on its way, follow heads over full places to the first place h with room; the head of the place z
   before it moves, or, if that closes a circle, the head of the circle's last place, which wants h too. *)
Require Import Model Chain Crowd.

Lemma in_first {A} (a : A) l : In a l -> forall m, In a (l ++ m). Proof. intros. apply in_or_app. auto. Qed.

Section Service.
Context `{R : roads}.
Hypothesis wide : forall p, 2 <= slots p.

(* the places that heads lead to from p, full ones beyond p *)
Inductive chain (D : config) (p : nat) : nat -> Prop :=
| begin : chain D p p
| along r x : chain D p r -> wants D r x -> full D x -> chain D p x.

(* z is the last on the chain, before h, which has room *)
Definition ends_at (D : config) p z h := chain D p z /\ wants D z h /\ ~ full D h.

(* the served head of p has not moved yet: m moves, from z or from the last of the circle that z would close *)
Inductive serve p (D E : config) : nat -> Prop :=
| last_one z h : ends_at D p z h -> move z D E -> ~ jammed E -> serve p D E z
| other_one z h w G : ends_at D p z h -> move z D G -> jammed G -> ahead G h w -> wants D w h -> w <> z ->
    full D w -> move w D E -> ~ jammed E -> serve p D E w.


(* every place of the chain leads on to the last *)
Inductive leads (D : config) : nat -> nat -> Prop :=
| same r : leads D r r
| step r x z : wants D r x -> full D x -> leads D x z -> leads D r z.

Lemma leads_on D a b x : leads D a b -> wants D b x -> full D x -> leads D a x.
Proof. induction 1; intros; [eapply step; eauto; constructor|]. eapply step; eauto. Qed.

Lemma two_ways D a b c : leads D a b -> leads D a c -> leads D b c \/ leads D c b.
Proof.
  intro H. revert c. induction H as [r|r x z W F L IH]; intros c K; auto.
  inversion K; subst; [right; eapply step; eauto|]. rewrite (wants_one _ _ _ _ H W) in *. auto.
Qed.

Lemma chain_leads D p r : chain D p r -> leads D p r.
Proof. induction 1; [constructor|]. eapply leads_on; eauto. Qed.

Lemma one_end D p z h z2 h2 : ends_at D p z h -> ends_at D p z2 h2 -> z = z2 /\ h = h2.
Proof.
  intros (C & W & N) (C2 & W2 & N2).
  assert (E : z = z2).
  { destruct (two_ways D p z z2) as [L|L]; try (apply chain_leads; auto); inversion L; subst; auto; exfalso.
    - apply N. rewrite (wants_one _ _ _ _ W H). auto.
    - apply N2. rewrite (wants_one _ _ _ _ W2 H). auto. }
  subst z2. split; auto. eapply wants_one; eauto.
Qed.

(* as long as nobody waits in a circle the chain ends, and somebody can be moved *)
Theorem service_goes_on p (D : config) : possible D -> ~ jammed D -> D p <> [] -> exists E m, serve p D E m.
Proof.
  intros P N NE.
  assert (Can : forall r, (exists q, wants D r q /\ ~ full D q) -> exists E, move r D E).
  { intros r (q & W & F). eapply head_can_move; eauto. }
  assert (H : exists z h, ends_at D p z h).
  { apply NNPP. intro H. apply N.
    assert (W : forall r, D r <> [] -> exists q, wants D r q).
    { intros r Nr. destruct (D r) as [|s l] eqn:E; [contradiction|]. exists (place (next s)), s. unfold head. rewrite E. auto. }
    assert (F : forall r q, chain D p r -> wants D r q -> full D q).
    { intros r q C Wq. apply NNPP. intro Nf. apply H. exists r, q. split; auto. }
    exists (fun r => chain D p r /\ full D r). split.
    - destruct (W p NE) as [q Wq]. exists q. assert (full D q) by (eapply F; eauto; constructor).
      split; auto. eapply along; eauto. constructor.
    - intros r [C Fr]. split; auto. destruct (W r) as [q Wq].
      { intro E. unfold full in Fr. rewrite E in Fr. specialize (wide r). simpl in Fr. lia. }
      exists q. assert (full D q) by (eapply F; eauto). repeat split; auto. eapply along; eauto. }
  destruct H as (z & h & C & W & Nf). destruct (Can z) as [E M]; eauto.
  destruct (classic (jammed E)) as [J|NJ]; [|exists E, z; apply (last_one p D E z h); auto; split; auto].
  destruct (last_of_circle_moves wide z h D E P N W M J) as (w & Nw & Fw & Ww & Aw & Ok).
  destruct (Can w) as [G MG]; eauto. exists G, w. apply (other_one p D G z h w E); auto. split; auto.
Qed.

Lemma serve_target p D E m : possible D -> serve p D E m -> exists h, wants D m h /\ ~ full D h /\ move m D E /\ ~ jammed E
  /\ (m = p \/ full D m) /\ exists z, ends_at D p z h.
Proof.
  intros P [z h (C & W & N) M NJ|z h w G (C & W & N) M J A Ww Nw Fw MG NJ]; exists h; repeat split; auto.
  - destruct C; auto.
  - exists z. split; auto.
  - exists z. split; auto.
Qed.

(* what a move leaves of the chain before the place that it leaves *)
Lemma chain_stays p D E m h r : possible D -> move m D E -> wants D m h -> ~ full D h -> m <> p -> chain D p r -> r <> m -> chain E p r.
Proof.
  intros P M W N Np C. induction C as [|r x C IH Wr Fx]; intro Nm; [constructor|].
  assert (Nr : r <> m) by (intro; subst; apply N; rewrite (wants_one _ _ _ _ W Wr); auto).
  destruct M as (s & line & Dm & Room & Em & Eq & Rest).
  assert (h = place (next s)) as ->.
  { destruct W as (t & H & <-). unfold head in H. rewrite Dm in H. injection H as ->. auto. }
  assert (x <> place (next s)) by (intro; subst; contradiction).
  eapply along; [apply IH; auto| |unfold full; rewrite Rest; auto].
  destruct Wr as (t & H1 & H2). exists t. split; auto. unfold head in *.
  destruct (Nat.eq_dec r (place (next s))) as [->|Nq]; [|rewrite Rest; auto].
  rewrite Eq. destruct (D (place (next s))); [discriminate|auto].
Qed.

Lemma wants_stays D E m r x : move m D E -> r <> m -> wants D r x -> wants E r x.
Proof.
  intros (s & line & Dm & Room & Em & Eq & Rest) Nr (t & H1 & H2). exists t. split; auto. unfold head in *.
  destruct (Nat.eq_dec r (place (next s))) as [->|Nq]; [|rewrite Rest; auto].
  rewrite Eq. destruct (D (place (next s))); [discriminate|auto].
Qed.

Lemma left_has_room m D E : possible D -> move m D E -> (exists h, wants D m h) -> ~ full E m.
Proof.
  intros P M [h W]. destruct (after_move wide m h D E P W M) as (_ & _ & N & _). auto.
Qed.

(* the next place with room is the one that moved last *)
Lemma next_hole p D E m h : possible D -> ~ jammed D -> serve p D E m -> m <> p -> wants D m h -> exists y, ends_at E p y m.
Proof.
  intros P NJ S Np Wm. destruct S as [z h' (C & W & N) M _|z h' w G (C & W & N) M [K J] A Ww Nw Fw MG _].
  - clear h Wm. rename h' into h.
    inversion C as [|r x Cr Wr Fz]; subst; [contradiction|].
    assert (Nr : r <> z) by (intro; subst; apply N; rewrite (wants_one _ _ _ _ W Wr); auto).
    exists r. split; [eapply chain_stays; eauto|split; [eapply wants_stays; eauto|eapply left_has_room; eauto]].
  - clear h Wm. rename h' into h.
    assert (PG := move_possible z D G P M).
    destruct (after_move wide z h D G P W M) as (Qh & _ & NFz & FuG & HeG).
    assert (Kh := new_jam wide z h D G K P NJ W M J). assert (FG : forall r, ahead G h r -> full G r).
    { intros r Ar. apply J. eapply jam_has_ahead; eauto. }
    assert (NFw : ~ full E w) by (apply (left_has_room w D E P MG); eauto).
    assert (Fh : full E h).
    { assert (FGh := FG h (here G h)). destruct M as (s & l & Ds & _ & _ & Eq & _). destruct MG as (t & l2 & Dt & _ & _ & Eq2 & _).
      assert (H1 : h = place (next s)) by (destruct W as (u & Hu & <-); unfold head in Hu; rewrite Ds in Hu; injection Hu as ->; auto).
      assert (H2 : h = place (next t)) by (destruct Ww as (u & Hu & <-); unfold head in Hu; rewrite Dt in Hu; injection Hu as ->; auto).
      rewrite <- H1 in Eq. rewrite <- H2 in Eq2. unfold full in *. rewrite Eq2. rewrite Eq, !app_length in *. simpl in *. lia. }
    assert (Nwh : w <> h) by (intro; subst; contradiction).
    assert (Cz : chain E p z) by (apply (chain_stays p D E w h z P MG Ww N Np C); congruence).
    assert (Ch : chain E p h) by (apply (along E p z h Cz); auto; apply (wants_stays D E w); auto).
    assert (FE : forall r, full G r -> r <> w -> full E r).
    { intros r Fr Nr. destruct (Nat.eq_dec r h) as [->|Nh]; auto. assert (FD := FuG r Nh Fr).
      destruct MG as (t & l2 & Dt & _ & _ & _ & Rest2). unfold full. rewrite Rest2; auto.
      intro; subst r. destruct Ww as (u & H & Hu). unfold head in H. rewrite Dt in H. injection H as ->. subst h. contradiction. }
    assert (Claim : forall x, ahead G h x -> chain E p x \/ exists y, chain E p y /\ wants E y w).
    { intros x Ax. induction Ax as [|r x Ar IH Wx]; auto. destruct IH as [Cr|Y]; auto.
      assert (Nr : r <> w) by (intro; subst; inversion Cr; subst; contradiction).
      assert (WD : wants D r x) by (apply HeG; auto; intro; subst; apply NFz; auto).
      assert (WE : wants E r x) by (eapply wants_stays; eauto).
      destruct (Nat.eq_dec x w) as [->|Nx]; [right; exists r; auto|left].
      eapply along; eauto. apply FE; auto. apply FG. eapply on; eauto. }
    destruct (Claim w A) as [Cw|(y & Cy & Wy)]; [inversion Cw; subst; contradiction|].
    exists y. split; auto.
Qed.
End Service.
Print Assumptions service_goes_on.
Print Assumptions next_hole.
